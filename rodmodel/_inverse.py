"""Pressures for a wanted bend or tip position: nearest to it, and with no more co-contraction than it takes.

What is wanted is a point: the tip's position, or the bend (θ cos γ, θ sin γ), which is smooth where the rod
is straight. The pressures that come nearest are sought by bounded least squares, in this order:

1. On the faces of the domain where one chamber has no pressure, so without co-contraction. Two chambers
   beside each other reach a sector of bending planes; the three sectors go round, and the likeliest is first.
2. Where no face reaches the target, in the whole domain, from the nearest point of the faces. Steps of least
   length keep the pressure of the third chamber no higher than they need.

3. Where that ends short of it, once more from there with co-contraction: the poses that three pressures reach
   are little more than a surface, and it is folded.

With loads, the search for the free rod, which costs little, says where to start, and each step solves and
differentiates in one kernel, from the solution of the step before.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, final

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from rodmodel._bounded import Box, Evaluate, Fit, boxes_of, least_squares
from rodmodel._solution import Numbers, Solution
from rodmodel._tip import Tip, TipChange
from rodmodel.calibration_file import Domain

# A target is reached within this much, of position [m] and of bend [rad].
POSITION_REACHED, BEND_REACHED = 1e-4, 1e-3

_FLAGGED = "throw=False flags this in the result instead"
_MESSAGES = [
    "bending_angle, bending_plane or tip_position: got a value that is not finite, or a negative angle, "
    f"expected finite numbers and an angle of 0 or more; {_FLAGGED}",
    "inverse: no equilibrium was found under the loads, expected finite loads that the rod can carry; "
    f"{_FLAGGED}",
]

Solve = Callable[[Float[Array, "3"]], Solution]
SolveTip = Callable[[Float[Array, "3"], Float[Array, "3"]], tuple[Tip, TipChange]]

# Part of the tolerance at which a search ends: two or three steps before the rounding.
_PART = 1e-3
# How near the free rod has to come to the target of a loaded one, of the rod's length or in radians. It
# cannot come all the way: three pressures reach hardly more than a surface.
_NEAR = 0.1
# Where the search on a face starts, as a fraction of the largest pressures; its sum is within the domain's.
_START = 0.3
# By how much pressures are raised for another start, as a fraction of the largest.
_CONTRACTION = 0.4


@final
class Inverse(eqx.Module):
    """Pressures for a target, and what they do.

    Where an input was not finite, or a wanted angle negative, every number is NaN and every flag false. Under
    `jax.vmap` each of the attributes has a leading axis.

    Attributes
    ----------
    pressure : of chambers 1, 2 and 3, within the calibrated domain [Pa]. Where the target is out of reach,
        those that come nearest to it.
    reached : whether the target is met, to 0.1 mm or 1e-3 rad.
    distance : that is left to the target: of the tip [m], or of the bend (θ cos γ, θ sin γ) [rad].
    converged : whether the search ended where no change of pressure comes nearer, with the rod solved there.
    steps : of the search.
    solution : of the rod at these pressures.
    """

    pressure: Float[Array, "3"]
    reached: Bool[Array, ""]
    distance: Float[Array, ""]
    converged: Bool[Array, ""]
    steps: Int[Array, ""]
    solution: Solution


@final
class Target(eqx.Module):
    """A point that is wanted: of the tip [m], or of the bend (θ cos γ, θ sin γ) [rad]."""

    point: Float[Array, " m"]
    good: Bool[Array, ""]
    """Whether it was finite and of no negative angle; otherwise `point` is zero."""
    unit: float = eqx.field(static=True)
    """By which distances are divided in the search, to be near one."""
    tolerance: float = eqx.field(static=True)

    @classmethod
    def of(
        cls,
        bending_angle: Numbers | None,
        bending_plane: Numbers | None,
        tip_position: Numbers | None,
        length: float,
    ) -> "Target":
        """Target of a bend [rad] or of a tip position [m], one of the two, for a rod with its cap [m]."""
        bend_given = [name for name in (bending_angle, bending_plane) if name is not None]
        if len(bend_given) + 2 * (tip_position is not None) != 2:
            names = {"bending_angle": bending_angle, "bending_plane": bending_plane}
            names["tip_position"] = tip_position
            given = " and ".join(name for name, value in names.items() if value is not None) or "none"
            raise ValueError(
                f"bending_angle, bending_plane, tip_position: got {given}, "
                "expected bending_angle and bending_plane, or tip_position alone"
            )
        if tip_position is not None:
            point = _numbers("tip_position", tip_position, (3,), "three coordinates [m]")
            good = jnp.all(jnp.isfinite(point))
            return cls(jnp.where(good, point, 0.0), good, length, POSITION_REACHED)
        angle = _numbers("bending_angle", bending_angle, (), "one angle [rad]")
        plane = _numbers("bending_plane", bending_plane, (), "one angle [rad]")
        good = jnp.isfinite(angle) & (angle >= 0.0) & jnp.isfinite(plane)
        angle, plane = jnp.where(good, angle, 0.0), jnp.where(good, plane, 0.0)
        return cls(angle * jnp.stack([jnp.cos(plane), jnp.sin(plane)]), good, 1.0, BEND_REACHED)

    def plane(self) -> Float[Array, ""]:
        """Bending plane γ in which the target lies [rad]."""
        # The tip goes opposite to γ, the bend along it.
        ahead = self.point[:2] if self.is_bend else -self.point[:2]
        nowhere = jnp.all(ahead == 0.0)
        return jnp.arctan2(jnp.where(nowhere, 0.0, ahead[1]), jnp.where(nowhere, 1.0, ahead[0]))

    @property
    def is_bend(self) -> bool:
        """Whether it is a bend, and not a position."""
        return self.point.shape == (2,)

    def miss(self, solution: Solution) -> Float[Array, " m"]:
        """Where a solution is, seen from the target [units of the search]."""
        at = solution.tip_position
        if self.is_bend:
            at = bend(solution.tip_rotation[:, 2], solution.bending_angle)
        return (at - self.point) / self.unit

    def miss_of(self, tip: Tip, change: TipChange) -> tuple[Float[Array, " m"], Float[Array, "m 3"]]:
        """Where a tip is, seen from the target, and its derivative by the pressures [units of the search]."""
        if not self.is_bend:
            return (tip.position - self.point) / self.unit, change.position[:, :3] / self.unit

        def of(turn: Float[Array, "3"]) -> Float[Array, "2"]:
            tangent = tip.rotation[:, 2] + jnp.cross(turn, tip.rotation[:, 2])
            return bend(tangent, tip.angle)

        missed = of(jnp.zeros_like(tip.position)) - self.point
        by_turn = jax.jacfwd(of)(jnp.zeros_like(tip.position))
        return missed / self.unit, by_turn @ change.turn[:, :3] / self.unit


class _Search(NamedTuple):
    best: Fit
    """So far, with the steps of all stages."""
    face: Int[Array, ""]
    """That it was found on, or from."""
    stage: Int[Array, ""]
    """0, 1, 2 for the faces, 3 for the whole domain from the best of them, 4 with co-contraction."""


def bend(tangent: Float[Array, "3"], angle: Float[Array, ""]) -> Float[Array, "2"]:
    """Bending angle as a vector (θ cos γ, θ sin γ) [rad], of the tip's tangent t; θ tells the half turn.

    With derivatives by t also where the rod is straight: θ = arctan(h/t_z), h² = t_x² + t_y², and
    θ (cos γ, sin γ) is −(t_x, t_y) θ/h.
    """
    ahead, up = -tangent[:2], tangent[2]
    size = jnp.sum(ahead**2)
    straight = (size < 1e-8) & (angle < 1.0)
    near = ahead / jnp.where(straight, up, 1.0) * (1.0 - size / 3.0)
    # Past a half turn θ grows as the tangent comes up again, on the other side.
    half_turns = jax.lax.stop_gradient(jnp.floor(angle / jnp.pi))
    back = half_turns % 2.0 == 1.0
    sine = jnp.sqrt(jnp.where(straight, 1.0, size))
    polar = jnp.arctan2(sine, up)
    theta = jnp.pi * half_turns + jnp.where(back, jnp.pi - polar, polar)
    return jnp.where(straight, near, jnp.where(back, -theta, theta) * ahead / sine)


@eqx.filter_jit
def find_pressure(
    solve: Solve,
    solve_free: Solve | None,
    solve_tip: SolveTip | None,
    domain: Domain,
    target: Target,
    throw: bool,
) -> Inverse:
    """Pressures in a domain that bring a rod nearest to a target.

    Parameters
    ----------
    solve : equilibrium at chamber pressures [Pa], flagged and not thrown where there is none.
    solve_free : the same without loads, cheaper; None where there are none.
    solve_tip : under the loads, the tip and its derivatives at pressures, from the unknown of a tip nearby.
    domain : of the pressures.
    target : what is wanted.
    throw : raise where the target was bad or the rod has no equilibrium under its loads.
    """
    scale = max(domain.pressure_max)
    boxes = boxes_of(domain)

    def evaluate_free(point: Float[Array, "3"], memory: Any) -> tuple[Array, Array, Any]:
        def miss(point: Float[Array, "3"]) -> tuple[Float[Array, " m"], Float[Array, " m"]]:
            solution = (solve if solve_free is None else solve_free)(scale * point)
            # Without an equilibrium there is no pose to speak of.
            missed = jnp.where(solution.converged, target.miss(solution), jnp.nan)
            return missed, missed

        slope, missed = jax.jacfwd(miss, has_aux=True)(point)
        return missed, slope, memory

    def search(
        evaluate: Evaluate, starts: Float[Array, "3 3"], order: Int[Array, "3"], within: float, memory: Any
    ) -> tuple[Fit, Int[Array, ""]]:
        """Best fit, and the face that it was found on or from; `within` a distance it is good enough."""
        enough = (_PART * target.tolerance / target.unit) ** 2

        def unfinished(at: _Search) -> Bool[Array, ""]:
            return (at.stage < 5) & ~(jnp.sqrt(at.best.cost) <= within)

        def advance(at: _Search) -> _Search:
            on_face = at.stage < 3
            face = order[jnp.minimum(at.stage, 2)]
            box = jax.tree.map(lambda leaf: leaf[jnp.where(on_face, face, 3)], boxes)
            from_best = jnp.where(at.stage == 3, at.best.point, _contracted(at.best.point, box))
            start = jnp.where(on_face, starts[face], from_best)
            fit = least_squares(evaluate, start, box, enough, memory)
            better = fit.cost < at.best.cost
            best = jax.tree.map(lambda new, old: jnp.where(better, new, old), fit, at.best)
            return _Search(
                best._replace(steps=at.best.steps + fit.steps),
                jnp.where(better & on_face, face, at.face),
                at.stage + 1,
            )

        none = jnp.zeros((), int)
        nowhere = Fit(starts[0], jnp.asarray(jnp.inf, starts.dtype), jnp.array(False), none, memory)
        end = jax.lax.while_loop(unfinished, advance, _Search(nowhere, order[0], none))
        return end.best, end.face

    faces = jax.tree.map(lambda leaf: leaf[:3], boxes)
    room = jnp.minimum(1.0, faces.total / jnp.sum(faces.upper, axis=1))
    starts = _START * room[:, None] * faces.upper
    # The chamber farthest from the way that the target lies is the one to do without.
    azimuth = 2.0 * jnp.pi / 3.0 * jnp.arange(3)
    away = jnp.cos(azimuth - target.plane())
    order = jnp.argsort(away)
    met = target.tolerance / target.unit
    fit, face = search(evaluate_free, starts, order, met if solve_tip is None else _NEAR, ())
    if solve_tip is not None:

        def evaluate(point: Float[Array, "3"], near: Float[Array, "3"]) -> tuple[Array, Array, Array]:
            tip, change = solve_tip(scale * point, near)
            missed, slope = target.miss_of(tip, change)
            return jnp.where(tip.converged, missed, jnp.nan), scale * slope, tip.unknown

        steps = fit.steps
        starts = starts.at[face].set(jnp.where(jnp.arange(3) == face, 0.0, fit.point))
        order = jnp.argsort(jnp.where(jnp.arange(3) == face, -2.0, away))
        fit, _ = search(evaluate, starts, order, met, jnp.full_like(fit.point, jnp.nan))
        fit = fit._replace(steps=fit.steps + steps)

    solution = solve(scale * fit.point)
    distance = jnp.sqrt(jnp.sum(target.miss(solution) ** 2)) * target.unit
    found = Inverse(
        pressure=scale * fit.point,
        reached=solution.converged & (distance <= target.tolerance),
        distance=distance,
        converged=fit.converged & solution.converged,
        steps=fit.steps,
        solution=solution,
    )
    found = jax.tree.map(lambda x: _only_where(target.good, x), found)
    if not throw:
        return found
    problems = jnp.logical_not(jnp.array([target.good, found.solution.converged]))
    return eqx.branched_error_if(found, jnp.any(problems), jnp.argmax(problems), _MESSAGES)


def _contracted(point: Float[Array, "3"], box: Box) -> Float[Array, "3"]:
    """A point with all pressures raised, within a box."""
    raised = jnp.minimum(point + _CONTRACTION, box.upper)
    return raised * jnp.minimum(1.0, box.total / jnp.sum(raised))


def _only_where(good: Bool[Array, ""], leaf: Array) -> Array:
    """A leaf where an input was good; NaN or false where it was not."""
    if eqx.is_inexact_array(leaf):
        return jnp.where(good, leaf, jnp.nan)
    return leaf & good if leaf.dtype == bool else leaf


def _numbers(name: str, value: Numbers | None, shape: tuple[int, ...], what: str) -> Array:
    """Argument as numbers of the default precision, or an error that names it."""
    try:
        numbers = jnp.asarray(value, float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: got {value!r}, expected {what}") from error
    if numbers.shape != shape:
        raise ValueError(f"{name}: got shape {numbers.shape}, expected {shape}: {what}")
    return numbers
