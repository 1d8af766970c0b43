"""Shooting with fixed steps: Newton's method, and the growth of the loads where it takes that."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from rodmodel._balance import Equilibrium, State, Variation
from rodmodel._components import (
    Quaternion,
    Scalar,
    Triple,
    apply,
    combine,
    cross,
    inverse,
    out_of_body,
    screw_by,
    triple,
)
from rodmodel._march import Nodes, base_state, march, put, step
from rodmodel._second_variation import end_resists, no_fold
from rodmodel._small_systems import solve_small

_MAX_SHOTS = 512
_SMALLEST_LOAD_STEP = 2.0**-16

# What keeps the rod on the branch of equilibria that it takes as the load grows from zero: in a load step, no
# u L changes by more than the first of these [rad], and no correction of Newton's method is more than the
# second of the one before (Deuflhard 2011, Newton Methods for Nonlinear Problems, ch. 5). Without them a long
# load step may end in another one, a coil.
_MAX_TURN = 1.0
_CONTRACTION = 0.5

CONVERGED, UNSTABLE, DIVERGED = 0, 1, 2
"""How the last load step that was tried ended."""


class Reached(NamedTuple):
    """Where a solve ends."""

    unknown: Float[Array, " n"]
    """u L at the base; after it, where there is a follower force, that force in the base frame [N]."""
    nodes: Nodes
    load_fraction: Float[Array, ""]
    """Of the loads, at which this is an equilibrium; 1 where all went well."""
    load_steps: Int[Array, ""]
    shots: Int[Array, ""]
    """Integrations from base to end."""
    stable: Bool[Array, ""]
    outcome: Int[Array, ""]
    """Of the last load step that was tried."""
    scale: Float[Array, " n"]
    """What makes the unknowns numbers near one."""

    @classmethod
    def free(cls, unknown: Float[Array, " n"]) -> "Reached":
        """Rod without loads, as an arc: nothing was solved."""
        none, one = jnp.zeros((), int), jnp.ones((), unknown.dtype)
        empty = Nodes(*(jnp.zeros((0, width), unknown.dtype) for width in (3, 4, 3)))
        return cls(unknown, empty, one, none, none, jnp.array(True), none + CONVERGED, jnp.ones_like(unknown))


class _Tangent(NamedTuple):
    jacobian: Float[Array, "n n"]
    """Of the imbalance by the unknowns over their scales."""
    stable: Bool[Array, ""]


class _Shot(NamedTuple):
    correction: Float[Array, " n"]
    """To be subtracted from the unknown, in its scale."""
    nodes: Nodes
    tangent: _Tangent


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
    tangent: _Tangent
    """What the last shot with neighbouring solutions found."""
    sure: Bool[Array, ""]
    """Whether the guess is expected to be within the tolerance: then it is only checked."""
    warm: Bool[Array, ""]
    """Whether this is still the start that was given."""


def follow(
    equilibrium: Equilibrium,
    start: Float[Array, " n"] | None,
    steps: int,
    tolerance: float,
    warm: Bool[Array, ""] | None = None,
    taken: Int[Array, ""] | None = None,
) -> Reached:
    """Solve for the equilibrium that the rod reaches from its free shape as the loads grow in proportion.

    The whole load is tried; a load step that fails is halved, one that succeeds lets the next be twice as
    long, from a start extrapolated along the last one.

    Parameters
    ----------
    equilibrium : equations and loads.
    start : where Newton's method is tried first, under the whole load, as after a small change of the loads.
        The equilibrium it leads to is taken, whether stable or not. If it leads to none, as without it.
    steps : of the integration, or how many there is room for.
    tolerance : on u L at the base [rad].
    warm : whether there is a start, where that is not known before.
    taken : steps of the integration, where they are not known before: the last nodes are zero then.

    Returns
    -------
    reached : where the full load cannot be reached, because the rod would buckle or snap on the way or the
        steps become too small, the equilibrium at the largest fraction of it that was.
    """
    law, length = equilibrium.law, equilibrium.actuator.bending_length
    dtype = law.free_curvature.dtype
    # A force that turns the end by about one, so that all unknowns are numbers near one.
    force_scale = law.expand(triple(law.free_curvature)).stiffness[0] / length**2
    scale = jnp.concatenate([jnp.ones(3, dtype), jnp.broadcast_to(force_scale, (3,))])[: equilibrium.unknowns]
    fewer = steps // 2 if taken is None else taken // 2

    def unfinished(at: _Progress) -> Bool[Array, ""]:
        possible = (at.step >= _SMALLEST_LOAD_STEP) & (at.reached.shots < _MAX_SHOTS)
        return (at.reached.load_fraction < 1.0) & possible

    def advance(at: _Progress) -> _Progress:
        reached = at.reached
        left = 1.0 - reached.load_fraction
        target = jnp.where(at.step < left, reached.load_fraction + at.step, 1.0)
        # Two integrations in three carry neighbouring solutions along, which make up most of their cost; the
        # last one, where Newton's method is already there, only has to show it.
        # A first guess is worth half as many steps: what they miss is less than what it does.
        rough = jnp.array(steps > 1) & (reached.shots == 0) & ~at.warm
        shot = jax.lax.cond(
            at.sure,
            lambda loaded: _check(loaded, at.guess, steps, taken, at.tangent),
            lambda loaded: _shoot(
                loaded, at.guess, steps, scale, jnp.where(rough, fewer, steps if taken is None else taken)
            ),
            scaled(equilibrium, target),
        )
        correction = -shot.correction
        size = jnp.max(jnp.abs(correction))

        done = (size <= tolerance) & ~rough
        near = jnp.max(jnp.abs(shot.nodes.turns - reached.nodes.turns)) <= _MAX_TURN
        good = done & (at.warm | (near & shot.tangent.stable))
        # Written so that a NaN is hopeless.
        hopeful = ~done & (size <= _CONTRACTION * at.size) & (size <= _MAX_TURN)

        new = Reached(
            at.guess,
            shot.nodes,
            target,
            reached.load_steps + 1,
            reached.shots,
            shot.tangent.stable,
            reached.outcome,
            scale,
        )
        # Newton's corrections: each the square of the last, or by the factor that the last two had.
        ratio = jnp.where(jnp.isfinite(at.size), size / at.size**2, 1.0)
        sure = hopeful & ~at.sure & ~rough & (ratio * size**2 <= tolerance)
        slope = jnp.where(good, (at.guess - reached.unknown) / at.step, at.slope)
        # A failed warm start is followed by the whole load from the free shape.
        factor = jnp.where(good, 2.0, jnp.where(hopeful | at.warm | rough, 1.0, 0.5))
        outcome = jnp.where(good, CONVERGED, jnp.where(done & near, UNSTABLE, DIVERGED))
        merged = jax.tree.map(lambda a, b: jnp.where(good, a, b), new, reached)
        merged = merged._replace(
            shots=reached.shots + 1, outcome=jnp.where(hopeful | rough, reached.outcome, outcome)
        )
        step = jnp.minimum(factor * at.step, 1.0 - merged.load_fraction)
        return _Progress(
            reached=merged,
            slope=slope,
            step=step,
            guess=jnp.where(hopeful, at.guess + scale * correction, merged.unknown + step * slope),
            size=jnp.where(hopeful & ~rough, size, jnp.inf),
            warm=at.warm & hopeful,
            tangent=shot.tangent,
            sure=sure,
        )

    begin = _begin(equilibrium, start, steps, warm)
    if taken is not None:
        turns = jnp.where(jnp.arange(steps + 1)[:, None] <= taken, begin.reached.nodes.turns, 0.0)
        begin = eqx.tree_at(lambda b: b.reached.nodes.turns, begin, turns)
    return jax.lax.while_loop(unfinished, advance, begin).reached


def shooting_jacobian(
    equilibrium: Equilibrium, unknown: Float[Array, " n"], steps: int, scale: Float[Array, " n"]
) -> tuple[Float[Array, "n n"], Nodes]:
    """Derivative of the imbalance at the end by the unknowns over their scales, and the nodes."""
    shot = _shoot(equilibrium, unknown, steps, scale)
    return shot.tangent.jacobian, shot.nodes


def scaled(equilibrium: Equilibrium, fraction: Float[Array, ""]) -> Equilibrium:
    """Equilibrium under a fraction of the loads."""
    loads = jax.tree.map(lambda load: fraction * load, equilibrium.loads)
    return eqx.tree_at(lambda e: e.loads, equilibrium, loads)


def _begin(
    equilibrium: Equilibrium, start: Float[Array, " n"] | None, steps: int, warm: Bool[Array, ""] | None
) -> _Progress:
    """Free shape, of which only the curvature is needed."""
    n, length = equilibrium.unknowns, equilibrium.actuator.bending_length
    free = equilibrium.law.free_curvature
    dtype = free.dtype
    turns = jnp.broadcast_to(length * free, (steps + 1, 3))
    nowhere = _free_shape(turns)
    slope = _first_slope(equilibrium, nowhere)
    none = jnp.zeros((), int)
    one = jnp.ones((), dtype)
    unknown = jnp.concatenate([length * free, jnp.zeros(n - 3, dtype)])
    reached = Reached(
        unknown,
        nowhere,
        0.0 * one,
        none,
        none,
        jnp.array(True),
        none + DIVERGED,
        jnp.ones(n, dtype),
    )
    return _Progress(
        reached,
        slope=slope,
        step=one,
        guess=_first_guess(unknown + slope, start, warm),
        size=jnp.inf * one,
        warm=jnp.array(start is not None) if warm is None else warm,
        tangent=_Tangent(jnp.eye(n, dtype=dtype), jnp.array(True)),
        sure=jnp.array(False),
    )


def _first_guess(
    cold: Float[Array, " n"], start: Float[Array, " n"] | None, warm: Bool[Array, ""] | None
) -> Float[Array, " n"]:
    if start is None:
        return cold
    return start if warm is None else jnp.where(warm, start, cold)


def _first_slope(equilibrium: Equilibrium, free: Nodes) -> Float[Array, " n"]:
    """Slope of the unknowns by the load fraction at no load.

    It is what the loads' moment about the base does there, with the rod in its free shape.
    """
    loads, actuator = equilibrium.loads, equilibrium.actuator
    positions = actuator.bending_length * free.positions
    w, x, y, z = free.quaternions[-1]
    none = jnp.zeros_like(w)
    frame, end = (w, x, y, z), triple(positions[-1])
    axis = out_of_body(frame, (none, none, none + 1.0))
    middle = triple(jnp.sum(positions[:-1] + positions[1:], axis=0) / (2.0 * (positions.shape[0] - 1)))
    moment = combine(
        (1.0, triple(loads.end_moment)),
        (1.0, out_of_body(frame, triple(loads.follower_moment))),
        (1.0, cross(end, triple(loads.end_force))),
        (1.0, cross(axis, triple(loads.lever))),
        (1.0, cross(middle, triple(loads.body_force))),
    )
    if equilibrium.offset is not None:
        aside = out_of_body(frame, triple(equilibrium.offset))
        moment = combine((1.0, moment), (1.0, cross(aside, triple(loads.cap_force))))
    forces: tuple[Scalar, ...] = ()
    if loads.follower_force is not None:
        pulled = out_of_body(frame, triple(loads.follower_force))
        arm = combine((1.0, end), (actuator.tip_length, axis))
        moment = combine((1.0, moment), (1.0, cross(arm, pulled)))
        forces = pulled
    stiffness = equilibrium.law.expand(triple(equilibrium.law.free_curvature)).stiffness
    turn = combine((actuator.bending_length, apply(inverse(stiffness), moment)))
    slope = jnp.stack([*turn, *forces])
    return jnp.where(jnp.all(jnp.isfinite(slope)), slope, 0.0)


def _free_shape(turns: Float[Array, "nodes 3"]) -> Nodes:
    """Shape of given curvatures, each step the screw of their mean."""
    size = 1.0 / (turns.shape[0] - 1)
    none = jnp.zeros_like(turns[0, 0])

    def along(
        at: tuple[Triple, Quaternion], turn: Float[Array, "3"]
    ) -> tuple[tuple[Triple, Quaternion], tuple[Array, Array]]:
        position, frame = at
        frame, shift = screw_by(frame, combine((size, triple(turn))), (none, none, none + size))
        position = combine((1.0, position), (1.0, shift))
        return (position, frame), (jnp.stack(position), jnp.stack(frame))

    start: tuple[Triple, Quaternion] = ((none, none, none), (none + 1.0, none, none, none))
    _, (positions, frames) = jax.lax.scan(along, start, 0.5 * (turns[:-1] + turns[1:]))
    base = jnp.stack(start[0])[None], jnp.stack(start[1])[None]
    return Nodes(jnp.concatenate([base[0], positions]), jnp.concatenate([base[1], frames]), turns)


def _shoot(
    equilibrium: Equilibrium,
    unknown: Float[Array, " n"],
    steps: int,
    scale: Float[Array, " n"],
    taken: Int[Array, ""] | None = None,
) -> _Shot:
    """Integrate from base to end, with the neighbouring solutions of each unknown.

    With fewer steps `taken` than there is room for nodes, the last ones are not set.
    """
    n, dtype = equilibrium.unknowns, unknown.dtype
    count = jnp.array(steps) if taken is None else taken
    size = 1.0 / count.astype(dtype)
    zero, one = jnp.zeros((), dtype), jnp.ones((), dtype)
    none = zero, zero, zero
    axes = [(one, zero, zero), (zero, one, zero), (zero, zero, one)]
    variations = [Variation(none, axis) for axis in axes]
    follower: Triple | None = None
    follower_variations: list[Triple | None] = [None, None, None]
    if n == 6:
        follower = triple(unknown[3:])
        variations += [Variation(none, none) for _ in axes]
        follower_variations += [combine((scale[3], axis)) for axis in axes]

    def along(
        number: Int[Array, ""], at: tuple[Triple, State, list[Variation], Bool[Array, ""], Nodes]
    ) -> tuple[Triple, State, list[Variation], Bool[Array, ""], Nodes]:
        position, state, before, stable, nodes = at
        fraction = size * number.astype(dtype)
        frame = state.quaternion
        state, shift, after = step(equilibrium, fraction, size, state, follower, before, follower_variations)
        position = combine((1.0, position), (1.0, shift))
        stable = stable & ((number == 0) | no_fold(before, frame, after, state.quaternion))
        return position, state, after, stable, put(nodes, number + 1, position, state)

    start = base_state(triple(unknown[:3]))
    nodes = put(Nodes.room(steps, dtype), 0, none, start)
    begin = none, start, variations, jnp.array(True), nodes
    _, end, variations, stable, nodes = jax.lax.fori_loop(0, count, along, begin)
    imbalance, changes = equilibrium.linearised_imbalance(end, follower, variations, follower_variations)
    columns = [jnp.concatenate([jnp.stack(part) for part in change]) for change in changes]
    jacobian = jnp.stack(columns, axis=1)
    missing = jnp.concatenate([jnp.stack(part) for part in imbalance])
    correction, determinant = solve_small(jacobian, missing)
    stable = _is_stable(equilibrium, jacobian, determinant, variations, stable)
    return _Shot(correction, nodes, _Tangent(jacobian, stable))


def _check(
    equilibrium: Equilibrium,
    unknown: Float[Array, " n"],
    steps: int,
    taken: Int[Array, ""] | None,
    tangent: _Tangent,
) -> _Shot:
    """Integrate from base to end, with the Jacobian of a shot nearby."""
    nodes, missing = march(equilibrium, unknown, steps, taken)
    return _Shot(solve_small(tangent.jacobian, missing)[0], nodes, tangent)


def _is_stable(
    equilibrium: Equilibrium,
    jacobian: Float[Array, "n n"],
    determinant: Float[Array, ""],
    variations: list[Variation],
    apart: Bool[Array, ""],
) -> Bool[Array, ""]:
    """Whether the second variation is positive; without a potential, whether no branching was passed."""
    no_branching = determinant > 0.0
    if equilibrium.unknowns == 6:
        return no_branching
    loads = equilibrium.loads
    conservative = jnp.all(loads.end_moment == 0.0) & jnp.all(loads.follower_moment == 0.0)
    return jnp.where(conservative, apart & end_resists(variations, jacobian), no_branching)
