"""Pressures for a wanted bend or tip position: nearest to it, and with no more co-contraction than it takes.

What is wanted is a point: the tip's position, or the bend (θ cos γ, θ sin γ), which is smooth where the rod
is straight. The pressures that come nearest are sought by bounded least squares, in this order:

1. On the faces of the domain where one chamber has no pressure, so without co-contraction. Two chambers
   beside each other reach a sector of bending planes; the three sectors go round, and the likeliest is first.
2. Where no face reaches the target, in the whole domain, from the nearest point of the faces; at once from
   one that comes close. Steps of least length keep the third chamber's pressure no higher than they need.

3. Where that ends short of it, once more from there with co-contraction: the poses that three pressures reach
   are little more than a surface, and it is folded.

With loads, the search for the free rod, which costs little, says where to start, and each step solves and
differentiates from the solution of the step before. All of it is one kernel.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple, final

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from rodmodel._bounded import Box, Evaluate, Fit, boxes_of, least_squares
from rodmodel._equilibria import FixedStep
from rodmodel._kernel import one_kernel
from rodmodel._loads import Resultants
from rodmodel._solution import Numbers, Solution
from rodmodel._tip import Tip, TipChange, free_tip, solve_and_differentiate_tip
from rodmodel.calibration_file import Actuator, Domain, Number
from rodmodel.section import SectionLaw

# A target is reached within this much, of position [m] and of bend [rad].
POSITION_REACHED, BEND_REACHED = 1e-4, 1e-3

_FLAGGED = "throw=False flags this in the result instead"
#: Of the problems that `find_pressure` tells.
MESSAGES = [
    "bending_angle, bending_plane or tip_position: got a value that is not finite, or a negative angle, "
    f"expected finite numbers and an angle of 0 or more; {_FLAGGED}",
    "inverse: no equilibrium was found under the loads, expected finite loads that the rod can carry; "
    f"{_FLAGGED}",
]

Solve = Callable[[Float[Array, "3"]], Solution]
TipAt = Callable[[Float[Array, "3"], Float[Array, "3"]], tuple[Tip, TipChange]]
"""Tip and its derivatives at pressures, from the unknown of a tip nearby."""

# Of the integration in the search under loads: the tip to 8e-6 of the length in the median, 1.4e-4 in 99 %
# of states. What is returned is solved with more.
_STEPS = 5
# Part of the tolerance at which a search ends: two or three steps before the rounding; under loads, at about
# what the integration errs by.
_PART, _LOADED_PART = 1e-3, 1e-2
# How near the free rod has to come to the target of a loaded one, of the rod's length or in radians. It
# cannot come all the way: three pressures reach hardly more than a surface.
_NEAR = 0.1
# A face that comes as near as that is followed into the domain before the other faces are tried, in the same
# units; and its nearest point need be no nearer than that part of the sum of squares.
_CLOSE, _WORTH = 0.05, 1e-2
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
    unit: Number
    """By which distances are divided in the search, to be near one."""
    tolerance: float = eqx.field(static=True)

    @classmethod
    def of(
        cls,
        bending_angle: Numbers | None,
        bending_plane: Numbers | None,
        tip_position: Numbers | None,
        length: Number,
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
    deepen: Bool[Array, ""]
    """Whether to search the whole domain from the best next, and then go on from the stage."""


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
    section: SectionLaw,
    actuator: Actuator,
    loads: Resultants | None,
    domain: Domain,
    target: Target,
) -> tuple[Inverse, Bool[Array, "2"]]:
    """Pressures in a domain that bring a rod nearest to a target.

    Parameters
    ----------
    solve : equilibrium at chamber pressures [Pa], flagged and not thrown where there is none.
    section, actuator : of the rod.
    loads : on the rod, in the frame of the base; None where there are none.
    domain : of the pressures.
    target : what is wanted.

    Returns
    -------
    found : pressures and the rod at them.
    problems : which of the messages are true: the target was bad; the rod has no equilibrium under its loads.
    """
    scale = _largest(domain)
    # The chamber farthest from the way that the target lies is the one to do without.
    azimuth = 2.0 * jnp.pi / 3.0 * jnp.arange(3)
    order = jnp.argsort(jnp.cos(azimuth - target.plane()))

    def sought(
        section: SectionLaw,
        actuator: Actuator,
        loads: Resultants | None,
        domain: Domain,
        point: Float[Array, " m"],
        unit: Number,
        order: Float[Array, "3"],
    ) -> Fit:
        wanted = replace(target, point=point, unit=unit)
        return _seek(section, actuator, loads, domain, wanted, order.astype(int))

    order = order.astype(target.point.dtype)
    fit: Fit = one_kernel(sought, section, actuator, loads, domain, target.point, target.unit, order)
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
    return found, jnp.logical_not(jnp.array([target.good, found.solution.converged]))


def _seek(
    section: SectionLaw,
    actuator: Actuator,
    loads: Resultants | None,
    domain: Domain,
    target: Target,
    order: Int[Array, "3"],
) -> Fit:
    """Search, within a kernel; `order` of the faces, the likeliest first."""
    scale = _largest(domain)
    boxes = boxes_of(domain)
    met = target.tolerance / target.unit

    def evaluate_with(tip_at: TipAt) -> Evaluate:
        def evaluate(point: Float[Array, "3"], near: Float[Array, "3"]) -> tuple[Array, Array, Array]:
            tip, change = tip_at(scale * point, near)
            missed, slope = target.miss_of(tip, change)
            # Without an equilibrium there is no pose to speak of.
            return jnp.where(tip.converged, missed, jnp.nan), scale * slope, tip.unknown

        return evaluate

    def search(
        tip_at: TipAt, starts: Float[Array, "3 3"], order: Int[Array, "3"], within: Number, part: float
    ) -> tuple[Fit, Int[Array, ""]]:
        """Best fit, and the face that it was found on or from; `within` a distance it is good enough.

        Each search on a face or in the domain ends at a `part` of the tolerance.
        """
        enough = (part * met) ** 2
        evaluate, cold = evaluate_with(tip_at), jnp.full_like(starts[0], jnp.nan)

        def unfinished(at: _Search) -> Bool[Array, ""]:
            return (at.stage < 5) & ~(jnp.sqrt(at.best.cost) <= within)

        def advance(at: _Search) -> _Search:
            on_face = (at.stage < 3) & ~at.deepen
            face = order[jnp.minimum(at.stage, 2)]
            box = jax.tree.map(lambda leaf: leaf[jnp.where(on_face, face, 3)], boxes)
            contract = (at.stage == 4) & ~at.deepen
            from_best = jnp.where(contract, _contracted(at.best.point, box), at.best.point)
            start = jnp.where(on_face, starts[face], from_best)
            memory = jnp.where(on_face | contract, cold, at.best.memory)
            worth = jnp.where(on_face, _WORTH, 0.0)
            fit = least_squares(evaluate, start, box, enough, worth, memory)
            # What starts from the best may come out of it by a rounding.
            better = fit.cost <= at.best.cost * (1.0 + 1e-6)
            best = jax.tree.map(lambda new, old: jnp.where(better, new, old), fit, at.best)
            deepen = on_face & better & (jnp.sqrt(fit.cost) <= _CLOSE)
            return _Search(
                best._replace(steps=at.best.steps + fit.steps),
                jnp.where(better & on_face, face, at.face),
                jnp.where(deepen, at.stage, at.stage + 1),
                deepen,
            )

        none = jnp.zeros((), int)
        nowhere = Fit(starts[0], jnp.asarray(jnp.inf, starts.dtype), jnp.array(False), none, cold)
        begin = _Search(nowhere, order[0], none, jnp.array(False))
        end = jax.lax.while_loop(unfinished, advance, begin)
        return end.best, end.face

    def free(pressure: Float[Array, "3"], near: Float[Array, "3"]) -> tuple[Tip, TipChange]:
        del near
        return free_tip(section, actuator, pressure)

    faces = jax.tree.map(lambda leaf: leaf[:3], boxes)
    room = jnp.minimum(1.0, faces.total / jnp.sum(faces.upper, axis=1))
    starts = _START * room[:, None] * faces.upper
    fit, face = search(free, starts, order, met if loads is None else _NEAR, _PART)
    if loads is None:
        return fit
    solver = FixedStep(_STEPS, tolerance=1e-8)
    under_loads = partial(solve_and_differentiate_tip, section, actuator, loads, solver, by_force=False)
    on_face = jnp.arange(3) == face
    starts = jnp.where(on_face[:, None], jnp.where(on_face, 0.0, fit.point), starts)
    first, second, third = order
    order = jnp.stack(
        [face, jnp.where(face == first, second, first), jnp.where(face == third, second, third)]
    )
    loaded, _ = search(under_loads, starts, order, met, _LOADED_PART)
    return loaded._replace(steps=loaded.steps + fit.steps)


def _largest(domain: Domain) -> Number:
    """Largest pressure in any chamber [Pa]."""
    first, second, third = domain.pressure_max
    if isinstance(first, jax.Array):
        return jnp.maximum(jnp.maximum(first, second), third)
    return max(first, second, third)


def _contracted(point: Float[Array, "3"], box: Box) -> Float[Array, "3"]:
    """A point with all pressures raised, within a box."""
    raised = jnp.minimum(point + _CONTRACTION, box.upper)
    return raised * jnp.minimum(1.0, box.total / jnp.sum(raised))


def _only_where(good: Bool[Array, ""], leaf: Array | float) -> Array | float:
    """A leaf where an input was good; NaN or false where it was not."""
    if isinstance(leaf, float):
        return leaf
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
