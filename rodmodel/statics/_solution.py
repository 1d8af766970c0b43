"""What a solve returns: the pose, the shape, and how far to trust them."""

from collections.abc import Callable, Sequence
from typing import Any, final

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from rodmodel.actuator import Number
from rodmodel.kinematics import Shape
from rodmodel.statics._shooting import DIVERGED, TOO_MANY_SHOTS, UNRESOLVED, UNSTABLE, Reached


class RESULTS(eqx.Enumeration):
    """How a solve ended."""

    successful = "the equilibrium under the whole load was found"
    bad_input = "a pressure was negative, an input not finite, or base_rotation no rotation"
    unstable = "the rod would snap, or buckle to no side in particular, before the whole load is on it"
    not_converged = "Newton's method found no equilibrium that the rod could have gone to"
    unresolved = "the rod turns too sharply for the steps along it: more of them, or Adaptive, may do"
    too_many_shots = "the bound on integrations from base to end was met before the whole load was on the rod"


def result_of(reached: Reached) -> RESULTS:
    """How a solve of good input ended."""
    # An enumeration's members are of its type, which a type checker does not see.
    names: Any = RESULTS
    ended = names.successful
    for outcome, name in (
        (DIVERGED, names.not_converged),
        (UNSTABLE, names.unstable),
        (UNRESOLVED, names.unresolved),
        (TOO_MANY_SHOTS, names.too_many_shots),
    ):
        ended = RESULTS.where(reached.outcome == outcome, name, ended)
    return ended


Numbers = ArrayLike | Sequence[float | int]
"""Numbers as they come: an array of JAX or NumPy, or a list."""


@final
class Solution(eqx.Module):
    """Equilibrium of the rod, in the world frame.

    Where a pressure was negative or an input not finite, every number is NaN and both flags are false. Under
    `jax.vmap` each of the attributes has a leading axis; call the methods under `jax.vmap` too.

    Attributes
    ----------
    tip_position : centre of the cap's outer face [m].
    tip_rotation : frame of the cap, directors as columns.
    bending_angle : angle θ of the tip's tangent from +z, continued past 180° [rad].
    bending_plane : azimuth γ in [0, 2π) [rad]; 0 where chamber 1 alone would bend the rod, 2π/3 for chamber
        2. Zero for a straight rod.
    bend : (θ cos γ, θ sin γ) [rad], smooth where the rod is straight and γ is not.
    chamber_volume : of each chamber, over the length of the body [m³]: −∂/∂p of the rod's energy at constant
        loads, what the loads do on the ends that the pressures move included.
    converged : whether the full load was reached. Where not, all is at `stats["load_fraction"]` of it.
    result : how the solve ended, one of [`RESULTS`][]; `converged` is that it was `successful`.
    stable : whether the second variation of the energy is positive here. Follower loads and moments have no
        energy; then, whether the loads have passed no branching of equilibria.
    in_domain : whether the pressures, and the moment everywhere on the body, are those of the calibration.
    error_estimate : within which θ of the finite elements is in 90 % of states [rad]; NaN outside the domain.
        Of the full actuator where the calibration knows of it, and of the cell elsewhere; see
        [`rodmodel.Calibration.angle_error`][]. It says nothing of what the finite elements leave out.
    stats : `load_fraction` reached, `load_steps` that it took, and `shots`: integrations from base to end.
    shape : of the body's axis in the frame of the first section, for the methods.
    unknown : what the shooting solved for, u L at the base and after it, where there is a follower force,
        that force in the frame of the first section [N]: a start for the next solve.
    base_position, base_rotation : where the base is; None for the origin, along +z.
    mount : frame of the first section in that of the base.
    tip_offset : how far the cap lies beside the end of the shape, in its frame [m].
    tip_length : of the straight part behind the shape, the cap in it [m].
    """

    tip_position: Float[Array, "3"]
    tip_rotation: Float[Array, "3 3"]
    bending_angle: Float[Array, ""]
    bending_plane: Float[Array, ""]
    bend: Float[Array, "2"]
    chamber_volume: Float[Array, "3"]
    converged: Bool[Array, ""]
    result: RESULTS
    stable: Bool[Array, ""]
    in_domain: Bool[Array, ""]
    error_estimate: Float[Array, ""]
    stats: dict[str, Float[Array, ""] | Int[Array, ""]]
    shape: Shape
    unknown: Float[Array, " n"]
    base_position: Float[Array, "3"] | None
    base_rotation: Float[Array, "3 3"] | None
    mount: Float[Array, "3 3"]
    tip_offset: Float[Array, "3"]
    tip_length: Number

    def centreline(self, arc_length: Numbers) -> Float[Array, "*s 3"]:
        """Position r(s) of the axis.

        Where the cap lies aside of the arc, the axis goes there over the whole length of the body.

        Parameters
        ----------
        arc_length : s [m], any shape, from 0 at the base to the cap's outer face; NaN comes back for others.

        Returns
        -------
        position : [m], world frame.
        """
        return self._along(Solution._position, arc_length)

    def frames(self, arc_length: Numbers) -> Float[Array, "*s 3 3"]:
        """Frame R(s). The cap has that of the body's end.

        Parameters
        ----------
        arc_length : s [m], any shape, from 0 at the base to the cap's outer face; NaN comes back for others.

        Returns
        -------
        frame : directors d₁, d₂, d₃ as columns, world frame.
        """
        return self._along(Solution._rotation, arc_length)

    def curvature(self, arc_length: Numbers) -> Float[Array, "*s 3"]:
        """Curvature and twist u(s); zero in the cap, which is rigid.

        Parameters
        ----------
        arc_length : s [m], any shape, from 0 at the base to the cap's outer face; NaN comes back for others.

        Returns
        -------
        curvature : [1/m], body frame.
        """
        return self._along(Solution._curvature, arc_length)

    def _position(self, s: Float[Array, ""]) -> Float[Array, "3"]:
        body = self._in_shape(s)
        position, rotation = self.shape.pose(body)
        # Straight on behind the shape.
        position = position + (s - body) * rotation[:, 2]
        position = self.mount @ (position + self._share_of_offset(body) * rotation @ self.tip_offset)
        if self.base_rotation is not None:
            position = self.base_rotation @ position
        return position if self.base_position is None else self.base_position + position

    def _rotation(self, s: Float[Array, ""]) -> Float[Array, "3 3"]:
        rotation = self.mount @ self.shape.pose(self._in_shape(s))[1]
        return rotation if self.base_rotation is None else self.base_rotation @ rotation

    def _curvature(self, s: Float[Array, ""]) -> Float[Array, "3"]:
        body = self._in_shape(s)
        curvature = self.shape.curvature(body)
        return jnp.where(s == body, curvature, jnp.zeros_like(curvature))

    def _in_shape(self, s: Float[Array, ""]) -> Float[Array, ""]:
        """The arc length of the shape that is nearest to s."""
        return jnp.clip(s, 0.0, self.shape.length)

    def _share_of_offset(self, s: Float[Array, ""]) -> Float[Array, ""]:
        """How much of its offset to the cap the axis has: all at the end of the shape.

        So goes the beam that bends least whose end moves aside without a turn.
        """
        x = s / self.shape.length
        return x * x * (3.0 - 2.0 * x)

    def _along(self, quantity: Callable[["Solution", Float[Array, ""]], Array], arc_length: Numbers) -> Array:
        return self._evaluate(quantity, jnp.asarray(arc_length, self.tip_position.dtype))

    @eqx.filter_jit
    def _evaluate(
        self, quantity: Callable[["Solution", Float[Array, ""]], Array], s: Float[Array, "*s"]
    ) -> Array:
        """Evaluate at each arc length; NaN outside the rod, a rounding of its length left aside."""
        values = jax.vmap(lambda s: quantity(self, s))(s.ravel())
        end = (self.shape.length + self.tip_length) * (1.0 + 4.0 * jnp.finfo(s.dtype).eps)
        inside = ((s >= 0.0) & (s <= end)).reshape((-1,) + (1,) * (values.ndim - 1))
        return jnp.where(inside, values, jnp.nan).reshape(s.shape + values.shape[1:])
