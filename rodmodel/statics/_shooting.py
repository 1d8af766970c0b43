"""Shooting: Newton's method for the unknowns at the base, with load steps where it needs them."""

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

# Both bounds keep the rod on the branch of equilibria that starts at zero load. Without them a long load step
# may end on another branch, a coil.
# Largest change of u L in a load step [rad].
_MAX_TURN = 1.0
# Largest ratio of a Newton correction to the one before (Deuflhard 2011, Newton Methods for Nonlinear
# Problems, ch. 5).
_CONTRACTION = 0.5

ARRIVED, UNSTABLE, DIVERGED, UNRESOLVED, TOO_MANY_SHOTS = range(5)
"""Outcomes of the last load step tried."""

Integrate = Callable[[Equilibrium, Array], tuple[State, Array]]
"""From the equations and their unknowns to sections from base to end, and whether these are resolved."""


class ShootingState(NamedTuple):
    """Equilibrium at which a solve ends."""

    unknown: Float[Array, " n"]
    """Unknowns: u L at the base, then the follower force, if there is one, in the base frame [N]."""
    nodes: State
    load_fraction: Float[Array, ""]
    """Fraction of the loads at which this is an equilibrium; 1 after a successful solve."""
    load_steps: Int[Array, ""]
    shots: Int[Array, ""]
    """Integrations from base to end."""
    stable: Bool[Array, ""]
    outcome: Int[Array, ""]
    """Outcome of the last load step tried."""


class _Progress(NamedTuple):
    reached: ShootingState
    slope: Float[Array, " n"]
    """Slope of the unknowns by the load fraction, over the last load step."""
    step: Float[Array, ""]
    """Current load step."""
    guess: Float[Array, " n"]
    """Newton's next iterate of the unknowns."""
    size: Float[Array, ""]
    """Size of the last correction to it; infinite for a first guess."""
    warm: Bool[Array, ""]
    """Whether Newton's method still runs from the given start."""


def shoot(
    equilibrium: Equilibrium,
    start: Float[Array, " n"] | None,
    integrate: Integrate,
    steps: int,
    tolerance: float,
) -> ShootingState:
    """Solve for the equilibrium that the rod reaches from its free shape as the loads grow in proportion.

    The first load step is the full load. A load step that fails is halved; one that succeeds doubles the
    next, whose start is extrapolated along it.

    Parameters
    ----------
    equilibrium : equations and loads.
    start : unknowns from which Newton's method starts first, under the full load, as after a small change of
        the loads. Its equilibrium is accepted, stable or not. If it finds none, the solve restarts cold.
    integrate : integration from base to end.
    steps : number of parts between the sections that `integrate` returns.
    tolerance : tolerance of Newton's method on u L at the base [rad].

    Returns
    -------
    reached : equilibrium under the full load; if the rod would buckle or snap before, or the load steps
        become too small, the one at the largest fraction that was reached.
    """
    law, length = equilibrium.law, equilibrium.actuator.bending_length
    free = length * law.free_curvature
    # A force that turns the end by about 1 rad: scaled by it, all unknowns are near one.
    force_scale = law.stiffness(law.free_curvature)[0, 0] / length**2
    scale = jnp.where(jnp.arange(equilibrium.unknowns) < 3, 1.0, force_scale).astype(free.dtype)

    def unfinished(at: _Progress) -> Bool[Array, ""]:
        possible = (at.step >= _SMALLEST_LOAD_STEP) & (at.reached.shots < _MAX_SHOTS)
        return (at.reached.load_fraction < 1.0) & possible

    def advance(at: _Progress) -> _Progress:
        reached = at.reached
        remaining = 1.0 - reached.load_fraction
        target = jnp.where(at.step < remaining, reached.load_fraction + at.step, 1.0)
        loaded = equilibrium.scaled(target)
        nodes, resolved = integrate(loaded, at.guess)
        changes, jacobian = by_unknowns(loaded, nodes, at.guess)
        solve = solve_3x3 if equilibrium.unknowns == 3 else jnp.linalg.solve
        correction = solve(jacobian, loaded.imbalance(_last(nodes), at.guess))
        size = jnp.max(jnp.abs(correction / scale))

        small = size <= tolerance
        stable = is_stable(loaded, nodes, changes, jacobian)
        near = jnp.max(jnp.abs(nodes.turn - reached.nodes.turn)) <= _MAX_TURN
        accepted = small & resolved & (at.warm | (near & stable))
        # Comparisons with a NaN are false: it ends the iteration.
        contracts = ~small & (size <= _CONTRACTION * at.size) & (size <= _MAX_TURN)
        unresolved = ~resolved & (small | ~jnp.isfinite(size))
        failed = jnp.where(unresolved, UNRESOLVED, jnp.where(small & near, UNSTABLE, DIVERGED))
        outcome = jnp.where(contracts, reached.outcome, jnp.where(accepted, ARRIVED, failed))

        new = ShootingState(at.guess, nodes, target, reached.load_steps + 1, reached.shots, stable, outcome)
        merged = jax.tree.map(lambda a, b: jnp.where(accepted, a, b), new, reached)
        merged = merged._replace(shots=reached.shots + 1, outcome=outcome)
        slope = jnp.where(accepted, (at.guess - reached.unknown) / at.step, at.slope)
        # After a failed warm start the full load is tried from the free shape.
        factor = jnp.where(accepted, 2.0, jnp.where(contracts | at.warm, 1.0, 0.5))
        step = jnp.minimum(factor * at.step, 1.0 - merged.load_fraction)
        return _Progress(
            reached=merged,
            slope=slope,
            step=step,
            guess=jnp.where(contracts, at.guess - correction, merged.unknown + step * slope),
            size=jnp.where(contracts, size, jnp.inf),
            warm=at.warm & contracts,
        )

    zero, one = jnp.zeros((), int), jnp.ones((), free.dtype)
    unknown = jnp.concatenate([free, jnp.zeros(equilibrium.unknowns - 3, free.dtype)])
    nodes = _free_shape(free, steps)
    slope = first_slope(equilibrium, nodes)
    begin = _Progress(
        ShootingState(unknown, nodes, 0.0 * one, zero, zero, jnp.array(True), zero + DIVERGED),
        slope=slope,
        step=one,
        guess=unknown + slope if start is None else start,
        size=jnp.inf * one,
        warm=jnp.array(start is not None),
    )
    reached: ShootingState = jax.lax.while_loop(unfinished, advance, begin).reached
    short = reached.load_fraction < 1.0
    outcome = jnp.where(short & (reached.outcome == ARRIVED), DIVERGED, reached.outcome)
    return reached._replace(outcome=jnp.where(short & (reached.shots >= _MAX_SHOTS), TOO_MANY_SHOTS, outcome))


def first_slope(equilibrium: Equilibrium, free: State) -> Float[Array, " n"]:
    """Return the slope of the unknowns by the load fraction at no load.

    The loads' moment about the base, on the rod in its free shape, bends the first section.
    """
    law, loads, actuator = equilibrium.law, equilibrium.loads, equilibrium.actuator
    length = actuator.bending_length
    weights = jnp.asarray(integral_weights(free.turn.shape[0] - 1), free.turn.dtype)
    middle, end = length * weights @ free.position, length * free.position[-1]
    frame = free.rotation[-1]
    axis = frame[:, 2]
    moment = loads.end_moment + frame @ loads.follower_moment
    moment = moment + jnp.cross(end, loads.end_force) + jnp.cross(axis, loads.lever)
    moment = moment + jnp.cross(middle, loads.body_force)
    moment = moment + jnp.cross(frame @ equilibrium.offset, loads.cap_force)
    follower = jnp.zeros(0, moment.dtype)
    if loads.follower_force is not None:
        follower = frame @ loads.follower_force
        moment = moment + jnp.cross(end + actuator.tip_length * axis + frame @ equilibrium.offset, follower)
    turn = length * solve_3x3(law.stiffness(law.free_curvature), moment)
    return jnp.concatenate([turn, follower])


def _free_shape(turn: Float[Array, "3"], steps: int) -> State:
    """Return the sections of the rod without loads, an arc."""

    def at(fraction: Float[Array, ""]) -> State:
        position, rotation = screw(fraction * turn, fraction * jnp.array([0.0, 0.0, 1.0], turn.dtype))
        return State(position, rotation, turn)

    return jax.vmap(at)(jnp.linspace(0.0, 1.0, steps + 1, dtype=turn.dtype))


def _last(nodes: State) -> State:
    return State(nodes.position[-1], nodes.rotation[-1], nodes.turn[-1])
