"""What the ends do besides not bending: the base turns with the pressures, and the cap goes aside.

At base and cap the closed chambers push on a face that holds the section's shape. The first section tilts by
an angle proportional to the pressures' moment, Σ_k p_k e_k with e_k the axis about which chamber k bends the
rod, less what the held section behind it does not bend, a length times û⊥. At the other end the body
straightens before the cap and turns the more in it, so that the cap comes out beside where the arc would end,
away from the bend, by

    a e₃ × û⊥ / (κ₀² + |û⊥|²)^½

with û the free curvature and û⊥ its part that bends. All is preset by the pressures: against loads the ends
are as compliant as the rest. So are the ends of the full finite-element actuator, to whose runs the numbers
in [`rodmodel.Actuator`][] are fitted.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel.calibration_file import Actuator

_AZIMUTHS = 2.0 * np.pi / 3.0 * np.arange(3)
_BENDING_AXES = np.stack([np.sin(_AZIMUTHS), -np.cos(_AZIMUTHS), np.zeros(3)], axis=1)


def base_turn(
    actuator: Actuator, pressure: Float[Array, "3"], free_curvature: Float[Array, "3"]
) -> Float[Array, "3"] | None:
    """Rotation vector of the first section, frame of the clamp [rad]; None where it does not turn."""
    if not (actuator.base_turn or actuator.base_lag):
        return None
    moment = jnp.sum(pressure[:, None] * jnp.asarray(_BENDING_AXES, pressure.dtype), axis=0)
    bend = jnp.stack([free_curvature[0], free_curvature[1], jnp.zeros_like(free_curvature[2])])
    return actuator.base_turn * moment - actuator.base_lag * bend


def tip_offset(actuator: Actuator, free_curvature: Float[Array, "3"]) -> Float[Array, "3"] | None:
    """How far the cap lies beside the body's end, in the frame of that end [m]; None for not at all."""
    if not actuator.tip_offset:
        return None
    x, y, _ = free_curvature
    size = actuator.tip_offset / jnp.sqrt(actuator.tip_offset_curvature**2 + x * x + y * y)
    return jnp.stack([-size * y, size * x, jnp.zeros_like(x)])
