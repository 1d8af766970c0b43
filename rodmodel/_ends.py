"""What the ends do besides not bending: the base turns with the pressures, and the cap goes aside.

At base and cap the closed chambers push on a face that holds the section's shape. The first section tilts by
an angle proportional to the pressures' moment, Σ_k p_k e_k with e_k the axis about which chamber k bends the
rod, less what the held section behind it does not bend, a length times û⊥. What is held back is a moment, so
a section of stiffness K = ∂m/∂u at û turns by K₀ K⁻¹ of that: pressures soften it, and the ends take more. At
the other end the body straightens before the cap and turns the more in it, so that the cap comes out beside
where the arc would end, away from the bend, by

    a e₃ × û⊥ / (κ₀² + |û⊥|²)^½

with û the free curvature and û⊥ its part that bends. All is preset by the pressures: against loads the ends
are as compliant as the rest. So are the ends of the full finite-element actuator, to whose runs the numbers
in [`rodmodel.Actuator`][] are fitted.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel._components import solve, triple
from rodmodel.calibration_file import Actuator, Number
from rodmodel.section import CurvatureLaw

_AZIMUTHS = 2.0 * np.pi / 3.0 * np.arange(3)
_BENDING_AXES = np.stack([np.sin(_AZIMUTHS), -np.cos(_AZIMUTHS), np.zeros(3)], axis=1)


def base_turn(
    actuator: Actuator, pressure: Float[Array, "3"], law: CurvatureLaw, free_curvature: Float[Array, "3"]
) -> Float[Array, "3"] | None:
    """Rotation vector of the first section, frame of the clamp [rad]; None where it does not turn.

    Parameters
    ----------
    actuator, pressure : of the rod.
    law : at that pressure; its own free curvature is not looked at.
    free_curvature : [1/m].
    """
    if is_zero(actuator.base_turn) and is_zero(actuator.base_lag):
        return None
    moment = jnp.sum(pressure[:, None] * jnp.asarray(_BENDING_AXES, pressure.dtype), axis=0)
    bend = jnp.stack([free_curvature[0], free_curvature[1], jnp.zeros_like(free_curvature[2])])
    turn = actuator.base_turn * moment - actuator.base_lag * bend
    if is_zero(actuator.base_stiffness):
        return turn
    _, (a, b, c, d, e, f) = law.linearise(triple(free_curvature))
    x, y, _ = solve(((a, b, c), (b, d, e), (c, e, f)), triple(actuator.base_stiffness * turn))
    softened = jnp.stack([x, y, jnp.zeros_like(x)])
    if isinstance(actuator.base_stiffness, float | int):
        return softened
    # Of a stack of rods, some may turn the same whatever their stiffness.
    return jnp.where(actuator.base_stiffness == 0.0, turn, softened)


def tip_offset(actuator: Actuator, free_curvature: Float[Array, "3"]) -> Float[Array, "3"] | None:
    """How far the cap lies beside the body's end, in the frame of that end [m]; None for not at all."""
    if is_zero(actuator.tip_offset):
        return None
    x, y, _ = free_curvature
    size = actuator.tip_offset / jnp.sqrt(actuator.tip_offset_curvature**2 + x * x + y * y)
    return jnp.stack([-size * y, size * x, jnp.zeros_like(x)])


def is_zero(number: Number) -> bool:
    """Whether it is known to be zero: not of what is being traced, nor of a stack of rods."""
    return isinstance(number, float | int) and number == 0


def cap_centre(
    actuator: Actuator,
    offset: Float[Array, "3"] | None,
    end: Float[Array, "3"],
    rotation: Float[Array, "3 3"],
) -> Float[Array, "3"]:
    """Centre of the cap's outer face, from the pose of the body's end and the cap's offset from it [m]."""
    position = end + actuator.tip_length * rotation[:, 2]
    return position if offset is None else position + product(rotation, offset)


def product(matrix: Float[Array, "3 3"], other: Float[Array, "3 *n"]) -> Float[Array, "3 *n"]:
    """Product with a vector or another matrix, term by term.

    XLA leaves matrix products, and sums that it takes for them, to a library, which cannot be part of a
    kernel.
    """
    first, second, third = (jnp.expand_dims(matrix[:, k], tuple(range(1, other.ndim))) for k in range(3))
    return first * other[0] + second * other[1] + third * other[2]
