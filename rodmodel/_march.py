"""Fixed steps along the rod: a Munthe-Kaas method of order 4, exact for constant curvature."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from rodmodel._balance import Equilibrium, State, Variation
from rodmodel._components import (
    Quaternion,
    Scalar,
    Triple,
    combine,
    cross,
    screw_by,
    triple,
    turn_by,
)

# Of the stages: how far into the step, factor of the bracket of k₁ with the stage before, weight.
_NODES = np.array([0.0, 0.5, 0.5, 1.0])
_BRACKETS = np.array([0.0, 0.0, 0.125, 0.0])
_WEIGHTS = np.array([1.0, 2.0, 2.0, 1.0]) / 6.0


class Nodes(NamedTuple):
    """Sections at the ends of the steps."""

    positions: Float[Array, "nodes 3"]
    """r/L, base frame."""
    quaternions: Float[Array, "nodes 4"]
    turns: Float[Array, "nodes 3"]
    """u L, body frame."""

    @classmethod
    def room(cls, steps: int, dtype: jnp.dtype) -> "Nodes":
        """Room for the nodes of so many steps, filled with zeros."""
        return cls(*(jnp.zeros((steps + 1, width), dtype) for width in (3, 4, 3)))


def step(
    equilibrium: Equilibrium,
    fraction: Scalar,
    size: float | Scalar,
    state: State,
    follower: Triple | None,
    variations: list[Variation],
    follower_variations: list[Triple | None],
) -> tuple[State, Triple, list[Variation]]:
    """One step along the rod.

    With k₁ … k₄ the values of u L at the stages of the classical Runge-Kutta method of order 4 and h the
    step's part of the length, the frames at the stages are R, R exp(h k₁/2), R exp(h k₂/2 + h² [k₁, k₂]/8)
    and R exp(h k₃), and that at the end R exp(Ω) with

        Ω = h (k₁ + 2 k₂ + 2 k₃ + k₄)/6 + h² [k₁, k₄]/12

    in se(3), brackets of the pair (e₃, u L). Where all k are equal, the step is the screw of that curvature.
    What shear adds to the position is summed over the stages with the same weights.

    Parameters
    ----------
    fraction, size : of the body's length: where the step starts, and h.
    state : at the start.
    follower : follower force in the base frame [N].
    variations, follower_variations : neighbouring solutions, which are integrated by the same Runge-Kutta
        method, in the body frame.

    Returns
    -------
    state : at the end.
    shift : change of r/L, base frame.
    variations : at the end, to order 4 those of the rod; not to the last digit those of the step.

    References
    ----------
    Munthe-Kaas and Owren (1999), Phil. Trans. R. Soc. A 357, 957, sec. 4. Brackets turn their sign, as the
    frame is multiplied from the right here.
    """
    q, first = state
    zero = jnp.zeros_like(first[0])
    none = zero, zero, zero
    still = [Variation(none, none) for _ in variations]

    def stage(number: Scalar, at: _Stages) -> _Stages:
        c, d, w = (
            size * jnp.asarray(row, zero.dtype)[number] for row in (_NODES, size * _BRACKETS, _WEIGHTS)
        )
        frame = turn_by(q, combine((c, at.turn), (d, cross(first, at.turn))))
        turn = combine((1.0, first), (c, at.rate))
        here = State(frame, turn)
        if variations:
            near = [_moved(v, c, rate) for v, rate in zip(variations, at.rates, strict=True)]
            rate, rates = equilibrium.linearised_rate(fraction + c, here, follower, near, follower_variations)
        else:
            rate, rates = equilibrium.turn_rate(fraction + c, here, follower), []
        return _Stages(
            turn,
            rate,
            rates,
            combine((1.0, at.turn_sum), (w, turn)),
            combine((1.0, at.rate_sum), (w, rate)),
            None
            if at.drift_sum is None
            else combine((1.0, at.drift_sum), (w, drift_at(fraction + c, frame))),
            [_moved(v, w, rate) for v, rate in zip(at.rates_sum, rates, strict=True)],
        )

    def drift_at(fraction: Scalar, frame: Quaternion) -> Triple:
        return equilibrium.drift(fraction, frame, follower)

    begin = _Stages(first, none, still, none, none, None if equilibrium.shear is None else none, still)
    end = jax.lax.fori_loop(0, 4, stage, begin)
    bracket = size * size / 12.0
    turn = combine((1.0, end.turn_sum), (bracket, cross(first, end.turn)))
    # The bracket's part along the axis, (k₁ − k₄) × e₃.
    change = combine((bracket, first), (-bracket, end.turn))
    frame, shift = screw_by(q, turn, (change[1], -change[0], zero + size))
    if end.drift_sum is not None:
        shift = combine((1.0, shift), (1.0, end.drift_sum))
    ends = [_moved(v, 1.0, rate) for v, rate in zip(variations, end.rates_sum, strict=True)]
    return State(frame, combine((1.0, first), (1.0, end.rate_sum))), shift, ends


class _Stages(NamedTuple):
    """Last stage of a step, and sums over its stages."""

    turn: Triple
    rate: Triple
    rates: list[Variation]
    turn_sum: Triple
    rate_sum: Triple
    drift_sum: Triple | None
    """None where sections do not shear."""
    rates_sum: list[Variation]


def _moved(variation: Variation, by: float | Scalar, rate: Variation) -> Variation:
    return Variation(
        combine((1.0, variation.rotation), (by, rate.rotation)),
        combine((1.0, variation.turn), (by, rate.turn)),
    )


def base_state(turn: Triple) -> State:
    """Section at the clamp."""
    one, zero = jnp.ones_like(turn[0]), jnp.zeros_like(turn[0])
    return State((one, zero, zero, zero), turn)


def march(
    equilibrium: Equilibrium,
    unknown: Float[Array, " n"],
    steps: int,
    taken: Int[Array, ""] | None = None,
) -> tuple[Nodes, Array]:
    """Integrate from base to end.

    Parameters
    ----------
    unknown : u L at the base; after it, where there is a follower force, that force in the base frame [N].
    steps : how many there is room for.
    taken : how many there are, where fewer: the last nodes are zero then.

    Returns
    -------
    nodes : `steps` + 1 of them.
    imbalance : at the end.
    """
    follower = triple(unknown[3:]) if equilibrium.unknowns == 6 else None
    count = steps if taken is None else taken
    size = 1.0 / steps if taken is None else 1.0 / taken.astype(unknown.dtype)

    def along(number: Int[Array, ""], at: tuple[Triple, State, Nodes]) -> tuple[Triple, State, Nodes]:
        position, state, nodes = at
        fraction = size * number.astype(unknown.dtype)
        state, shift, _ = step(equilibrium, fraction, size, state, follower, [], [])
        position = combine((1.0, position), (1.0, shift))
        return position, state, put(nodes, number + 1, position, state)

    start = base_state(triple(unknown[:3]))
    zero = jnp.zeros_like(unknown[0])
    none = zero, zero, zero
    nodes = put(Nodes.room(steps, unknown.dtype), 0, none, start)
    _, end, nodes = jax.lax.fori_loop(0, count, along, (none, start, nodes))
    return nodes, jnp.concatenate([jnp.stack(part) for part in equilibrium.end_imbalance(end, follower)])


def put(nodes: Nodes, number: Int[Array, ""] | int, position: Triple, state: State) -> Nodes:
    """Nodes with one of them set."""
    rows = Nodes(*map(jnp.stack, (position, *state)))
    return jax.tree.map(
        lambda all_rows, row: jax.lax.dynamic_update_index_in_dim(all_rows, row, number, 0), nodes, rows
    )
