"""Solution of a rod: pose, shape, flags and error estimate."""

from collections.abc import Callable, Sequence
from typing import Any, final

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from rodmodel.actuator import Number
from rodmodel.kinematics import Shape
from rodmodel.statics._shooting import DIVERGED, TOO_MANY_SHOTS, UNRESOLVED, UNSTABLE, ShootingState


class RESULTS(eqx.Enumeration):
    """Result of a solve."""

    successful = "the equilibrium under the full load was found"
    bad_input = "a pressure is negative, an input is not finite, or base_rotation is no rotation"
    unstable = "the rod would snap, or buckle to an undetermined side, before it carries the full load"
    not_converged = "Newton's method found no equilibrium on the branch that the rod follows from rest"
    unresolved = "the rod bends too sharply for the steps along it; take more steps, or Adaptive"
    too_many_shots = "the limit on integrations from base to end was met before the full load was reached"


def result_of(reached: ShootingState) -> RESULTS:
    """Return the result of a solve with valid input."""
    # Any, as type checkers take the members for strings.
    names: Any = RESULTS
    result = names.successful
    for outcome, name in (
        (DIVERGED, names.not_converged),
        (UNSTABLE, names.unstable),
        (UNRESOLVED, names.unresolved),
        (TOO_MANY_SHOTS, names.too_many_shots),
    ):
        result = RESULTS.where(reached.outcome == outcome, name, result)
    return result


Numbers = ArrayLike | Sequence[float | int]
"""Input of numbers: an array of JAX or NumPy, or a list."""


@final
class Solution(eqx.Module):
    """Equilibrium of the rod, in the world frame.

    If a pressure was negative or an input not finite, every number is NaN and both flags are false. Under
    `jax.vmap` each attribute has a leading axis; call the methods under `jax.vmap` too.

    Attributes
    ----------
    tip_position : centre of the cap's outer face [m].
    tip_rotation : frame of the cap, directors as columns.
    bending_angle : angle θ of the tip's tangent from +z, continued past 180° [rad].
    bending_plane : azimuth γ in [0, 2π) [rad]: 0 if chamber 1 alone bends the rod, 2π/3 for chamber 2. Zero
        for a straight rod.
    bend : (θ cos γ, θ sin γ) [rad], smooth where the rod is straight and γ is not.
    chamber_volume : volume of each chamber over the length of the body [m³]: −∂/∂p of the rod's energy at
        constant loads, with the work of the loads on the ends that the pressures move.
    converged : whether the full load was reached. If not, everything is at `stats["load_fraction"]` of it.
    result : result of the solve, one of [`RESULTS`][]; `converged` means `successful`.
    stable : whether the second variation of the energy is positive. Follower loads and moments have no
        energy; then, whether the loads have passed no bifurcation.
    in_domain : whether the pressures, and the moment everywhere on the body, are in the calibrated domain,
        the forces shear no section by more than 0.2 rad, and the base turns by no more than 0.5 rad.
    error_estimate : bound of the error of θ that 90 % of states keep [rad]; NaN outside the domain. It
        depends on the pressures' sum and the loads: see [`rodmodel.ErrorBound`][] and
        [`rodmodel.Calibration.error_bound`][].
    tip_error_estimate : likewise of the tip's distance from where it is [m]; NaN also where none is known.
    stats : `load_fraction` reached, number of `load_steps`, and `shots`: integrations from base to end.
    shape : shape of the body's axis in the frame of the first section, for the methods.
    unknown : solution of the shooting, a start for the next solve: u L at the base, then the follower force,
        if there is one, in the frame of the first section [N].
    base_position, base_rotation : pose of the base; None for the origin, along +z.
    mount : frame of the first section in that of the base.
    tip_offset : offset of the cap from the end of the shape, in its frame [m].
    tip_length : length of the straight part beyond the shape, cap included [m].
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
    tip_error_estimate: Float[Array, ""]
    stats: dict[str, Float[Array, ""] | Int[Array, ""]]
    shape: Shape
    unknown: Float[Array, " n"]
    base_position: Float[Array, "3"] | None
    base_rotation: Float[Array, "3 3"] | None
    mount: Float[Array, "3 3"]
    tip_offset: Float[Array, "3"]
    tip_length: Number

    def centreline(self, arc_length: Numbers) -> Float[Array, "*s 3"]:
        """Return the position r(s) of the axis.

        The offset of the cap is spread over the whole length of the body.

        Parameters
        ----------
        arc_length : s [m], any shape, from 0 at the base to the cap's outer face; others give NaN.

        Returns
        -------
        position : [m], world frame.
        """
        return self._along(Solution._position, arc_length)

    def frames(self, arc_length: Numbers) -> Float[Array, "*s 3 3"]:
        """Return the frame R(s); the cap has the frame of the body's end.

        Parameters
        ----------
        arc_length : s [m], any shape, from 0 at the base to the cap's outer face; others give NaN.

        Returns
        -------
        frame : directors d₁, d₂, d₃ as columns, world frame.
        """
        return self._along(Solution._rotation, arc_length)

    def curvature(self, arc_length: Numbers) -> Float[Array, "*s 3"]:
        """Return curvature and twist u(s); zero in the cap, which is rigid.

        Parameters
        ----------
        arc_length : s [m], any shape, from 0 at the base to the cap's outer face; others give NaN.

        Returns
        -------
        curvature : [1/m], body frame.
        """
        return self._along(Solution._curvature, arc_length)

    def _position(self, s: Float[Array, ""]) -> Float[Array, "3"]:
        body = self._in_shape(s)
        position, rotation = self.shape.pose(body)
        # Beyond the shape the axis is straight.
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
        """Return the arc length of the shape that is nearest to s."""
        return jnp.clip(s, 0.0, self.shape.length)

    def _share_of_offset(self, s: Float[Array, ""]) -> Float[Array, ""]:
        """Return the share of the cap's offset that the axis has at s, 1 at the end of the shape.

        A beam whose end is displaced sideways without a turn deflects in this way.
        """
        x = s / self.shape.length
        return x * x * (3.0 - 2.0 * x)

    def _along(self, quantity: Callable[["Solution", Float[Array, ""]], Array], arc_length: Numbers) -> Array:
        return self._evaluate(quantity, jnp.asarray(arc_length, self.tip_position.dtype))

    @eqx.filter_jit
    def _evaluate(
        self, quantity: Callable[["Solution", Float[Array, ""]], Array], s: Float[Array, "*s"]
    ) -> Array:
        """Evaluate a quantity at each arc length; NaN outside the rod, up to a rounding of its length."""
        values = jax.vmap(lambda s: quantity(self, s))(s.ravel())
        end = (self.shape.length + self.tip_length) * (1.0 + 4.0 * jnp.finfo(s.dtype).eps)
        inside = ((s >= 0.0) & (s <= end)).reshape((-1,) + (1,) * (values.ndim - 1))
        return jnp.where(inside, values, jnp.nan).reshape(s.shape + values.shape[1:])
