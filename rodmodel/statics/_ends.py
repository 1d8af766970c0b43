"""Effects of the ends: the base turns with the pressures, and the cap is offset from the arc.

At base and cap the closed chambers push on a face that holds the section's shape. The first section tilts by
an angle proportional to the pressures' moment, Σ_k p_k e_k with e_k the axis about which chamber k bends the
rod, less a length times û⊥ that the held section does not bend. The end withholds a moment, so a section of
stiffness K = ∂m/∂u at û turns by S = K₀ K⁻¹ of that: where pressures soften the section, the ends turn more.
A softer section also feels the face farther along the rod, over 1 + g (S − 1) times the length. At the other
end the body straightens before the cap and turns more inside it. The cap is therefore offset from
the end of the arc, away from the bend, and lies nearer to the base the more the body bends, by

    a e₃ × û⊥ / (κ₀² + |û⊥|²)^½ − b |û⊥|² e₃

with û the free curvature and û⊥ its bending part. Both effects depend on the pressures alone: against loads
the ends are as compliant as the rest. So are the ends of the full finite-element actuator, to whose runs the
numbers in [`rodmodel.Actuator`][] are fitted.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from rodmodel.actuator import Actuator
from rodmodel.section import CurvatureLaw, solve_3x3

_AZIMUTHS = 2.0 * np.pi / 3.0 * np.arange(3)
#: Axis about which pressure in each chamber bends a section.
BENDING_AXES = np.stack([np.sin(_AZIMUTHS), -np.cos(_AZIMUTHS), np.zeros(3)], axis=1)
_ACROSS = np.array([1.0, 1.0, 0.0])
# Largest turn of the base that is believed [rad]: elsewhere in their domains the laws that ship have up to
# 0.3. A section that is about to give way would turn it by any angle.
_TURNED = 0.5


def base_turn(actuator: Actuator, pressure: Float[Array, "3"], law: CurvatureLaw) -> Float[Array, "3"]:
    """Return the rotation vector of the first section, frame of the clamp [rad].

    Parameters
    ----------
    actuator : dimensions and numbers of the ends.
    pressure : gauge pressures [Pa].
    law : section law at these pressures.
    """
    across = jnp.asarray(_ACROSS, pressure.dtype)
    moment = pressure @ jnp.asarray(BENDING_AXES, pressure.dtype)
    turn = actuator.base_turn * moment - actuator.base_lag * across * law.free_curvature
    stiffness = law.stiffness(law.free_curvature)
    once = across * solve_3x3(stiffness, actuator.base_stiffness * turn)
    twice = across * solve_3x3(stiffness, actuator.base_stiffness * once)
    softened = once + actuator.base_growth * (twice - once)
    return jnp.where(actuator.base_stiffness == 0.0, turn, softened)


def turns_little(turn: Float[Array, "3"]) -> Bool[Array, ""]:
    """Return whether a base turns by no more than is believed."""
    return jnp.sum(turn * turn) <= _TURNED**2


def tip_offset(actuator: Actuator, free_curvature: Float[Array, "3"]) -> Float[Array, "3"]:
    """Return the offset of the cap from the body's end, in the frame of that end [m]."""
    x, y, _ = free_curvature
    size = actuator.tip_offset / jnp.sqrt(actuator.tip_offset_curvature**2 + x * x + y * y)
    return jnp.stack([-size * y, size * x, -actuator.tip_draw * (x * x + y * y)])


def cap_centre(
    actuator: Actuator,
    offset: Float[Array, "3"],
    end: Float[Array, "3"],
    rotation: Float[Array, "3 3"],
) -> Float[Array, "3"]:
    """Return the centre of the cap's outer face [m], from the pose of the body's end and the cap's offset."""
    return end + actuator.tip_length * rotation[:, 2] + rotation @ offset
