"""Shooting: Newton's method for what is unknown at the base, and growth of the loads where it takes that."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from rodmodel.kinematics import integral_weights, screw
from rodmodel.section import solve_3x3
from rodmodel.statics._equilibrium import Equilibrium, State
from rodmodel.statics._sensitivity import by_unknowns
from rodmodel.statics._stability import is_stable

_MAX_SHOTS = 1024
_SMALLEST_LOAD_STEP = 2.0**-16

# What keeps the rod on the branch of equilibria that it takes as the load grows from zero: in a load step, no
# u L changes by more than the first of these [rad], and no correction of Newton's method is more than the
# second of the one before (Deuflhard 2011, Newton Methods for Nonlinear Problems, ch. 5). Without them a long
# load step may end in another one, a coil.
_MAX_TURN = 1.0
_CONTRACTION = 0.5

ARRIVED, UNSTABLE, DIVERGED, UNRESOLVED, TOO_MANY_SHOTS = range(5)
"""How the last load step that was tried ended."""

Integrate = Callable[[Equilibrium, Array], tuple[State, Array]]
"""From the equations and their unknowns to sections from base to end, and whether these are resolved."""


class Reached(NamedTuple):
    """Where a solve ends."""

    unknown: Float[Array, " n"]
    """u L at the base; after it, where there is a follower force, that force in the base frame [N]."""
    nodes: State
    load_fraction: Float[Array, ""]
    """Of the loads, at which this is an equilibrium; 1 where all went well."""
    load_steps: Int[Array, ""]
    shots: Int[Array, ""]
    """Integrations from base to end."""
    stable: Bool[Array, ""]
    outcome: Int[Array, ""]
    """Of the last load step that was tried."""


class _Progress(NamedTuple):
    reached: Reached
    slope: Float[Array, " n"]
    """Of the unknown by the load fraction, over the last load step."""
    step: Float[Array, ""]
    """Load step that is being tried."""
    guess: Float[Array, " n"]
    """Unknown that Newton's method tries next."""
    size: Float[Array, ""]
    """Size of the last correction to it; infinite for a first guess."""
    warm: Bool[Array, ""]
    """Whether this is still the start that was given."""


def shoot(
    equilibrium: Equilibrium,
    start: Float[Array, " n"] | None,
    integrate: Integrate,
    steps: int,
    tolerance: float,
) -> Reached:
    """Solve for the equilibrium that the rod reaches from its free shape as the loads grow in proportion.

    The whole load is tried; a load step that fails is halved, one that succeeds lets the next be twice as
    long, from a start extrapolated along the last one.

    Parameters
    ----------
    equilibrium : equations and loads.
    start : where Newton's method is tried first, under the whole load, as after a small change of the loads.
        The equilibrium it leads to is taken, whether stable or not. If it leads to none, as without it.
    integrate : from base to end.
    steps : between the sections that it gives.
    tolerance : of Newton's method on u L at the base [rad].

    Returns
    -------
    reached : where the full load cannot be reached, because the rod would buckle or snap on the way or the
        steps become too small, the equilibrium at the largest fraction of it that was.
    """
    law, length = equilibrium.law, equilibrium.actuator.bending_length
    free = length * law.free_curvature
    # A force that turns the end by about one, so that all unknowns are numbers near one.
    force_scale = law.stiffness(law.free_curvature)[0, 0] / length**2
    scale = jnp.where(jnp.arange(equilibrium.unknowns) < 3, 1.0, force_scale).astype(free.dtype)

    def unfinished(at: _Progress) -> Bool[Array, ""]:
        possible = (at.step >= _SMALLEST_LOAD_STEP) & (at.reached.shots < _MAX_SHOTS)
        return (at.reached.load_fraction < 1.0) & possible

    def advance(at: _Progress) -> _Progress:
        reached = at.reached
        left = 1.0 - reached.load_fraction
        target = jnp.where(at.step < left, reached.load_fraction + at.step, 1.0)
        loaded = equilibrium.scaled(target)
        nodes, resolved = integrate(loaded, at.guess)
        changes, jacobian = by_unknowns(loaded, nodes, at.guess)
        solve = solve_3x3 if equilibrium.unknowns == 3 else jnp.linalg.solve
        correction = solve(jacobian, loaded.imbalance(_last(nodes), at.guess))
        size = jnp.max(jnp.abs(correction / scale))

        done = size <= tolerance
        stable = is_stable(loaded, nodes, changes, jacobian)
        near = jnp.max(jnp.abs(nodes.turn - reached.nodes.turn)) <= _MAX_TURN
        good = done & resolved & (at.warm | (near & stable))
        # Written so that a NaN is hopeless.
        hopeful = ~done & (size <= _CONTRACTION * at.size) & (size <= _MAX_TURN)
        unresolved = ~resolved & (done | ~jnp.isfinite(size))
        failed = jnp.where(unresolved, UNRESOLVED, jnp.where(done & near, UNSTABLE, DIVERGED))
        outcome = jnp.where(hopeful, reached.outcome, jnp.where(good, ARRIVED, failed))

        new = Reached(at.guess, nodes, target, reached.load_steps + 1, reached.shots, stable, outcome)
        merged = jax.tree.map(lambda a, b: jnp.where(good, a, b), new, reached)
        merged = merged._replace(shots=reached.shots + 1, outcome=outcome)
        slope = jnp.where(good, (at.guess - reached.unknown) / at.step, at.slope)
        # A failed warm start is followed by the whole load from the free shape.
        factor = jnp.where(good, 2.0, jnp.where(hopeful | at.warm, 1.0, 0.5))
        step = jnp.minimum(factor * at.step, 1.0 - merged.load_fraction)
        return _Progress(
            reached=merged,
            slope=slope,
            step=step,
            guess=jnp.where(hopeful, at.guess - correction, merged.unknown + step * slope),
            size=jnp.where(hopeful, size, jnp.inf),
            warm=at.warm & hopeful,
        )

    none, one = jnp.zeros((), int), jnp.ones((), free.dtype)
    unknown = jnp.concatenate([free, jnp.zeros(equilibrium.unknowns - 3, free.dtype)])
    nodes = _free_shape(free, steps)
    slope = first_slope(equilibrium, nodes)
    begin = _Progress(
        Reached(unknown, nodes, 0.0 * one, none, none, jnp.array(True), none + DIVERGED),
        slope=slope,
        step=one,
        guess=unknown + slope if start is None else start,
        size=jnp.inf * one,
        warm=jnp.array(start is not None),
    )
    reached: Reached = jax.lax.while_loop(unfinished, advance, begin).reached
    short = reached.load_fraction < 1.0
    outcome = jnp.where(short & (reached.outcome == ARRIVED), DIVERGED, reached.outcome)
    return reached._replace(outcome=jnp.where(short & (reached.shots >= _MAX_SHOTS), TOO_MANY_SHOTS, outcome))


def first_slope(equilibrium: Equilibrium, free: State) -> Float[Array, " n"]:
    """Slope of the unknowns by the load fraction at no load.

    It is what the loads' moment about the base does there, with the rod in its free shape.
    """
    law, loads, actuator = equilibrium.law, equilibrium.loads, equilibrium.actuator
    length = actuator.bending_length
    weights = jnp.asarray(integral_weights(free.turn.shape[0] - 1), free.turn.dtype)
    middle, end = length * weights @ free.position, length * free.position[-1]
    frame = free.rotation[-1]
    ahead = frame[:, 2]
    moment = loads.end_moment + frame @ loads.follower_moment
    moment = moment + jnp.cross(end, loads.end_force) + jnp.cross(ahead, loads.lever)
    moment = moment + jnp.cross(middle, loads.body_force)
    moment = moment + jnp.cross(frame @ equilibrium.offset, loads.cap_force)
    pull = jnp.zeros(0, moment.dtype)
    if loads.follower_force is not None:
        pull = frame @ loads.follower_force
        moment = moment + jnp.cross(end + actuator.tip_length * ahead + frame @ equilibrium.offset, pull)
    turn = length * solve_3x3(law.stiffness(law.free_curvature), moment)
    return jnp.concatenate([turn, pull])


def _free_shape(turn: Float[Array, "3"], steps: int) -> State:
    """Sections of the rod without loads, an arc."""

    def at(fraction: Float[Array, ""]) -> State:
        position, rotation = screw(fraction * turn, fraction * jnp.array([0.0, 0.0, 1.0], turn.dtype))
        return State(position, rotation, turn)

    return jax.vmap(at)(jnp.linspace(0.0, 1.0, steps + 1, dtype=turn.dtype))


def _last(nodes: State) -> State:
    return State(nodes.position[-1], nodes.rotation[-1], nodes.turn[-1])
