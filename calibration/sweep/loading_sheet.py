"""Follow a path on where the section loses its lateral stability.

Chamber walls then lean to one side by themselves, and the section would bend out of its plane. Within an
actuator the neighbouring sections, the base and the cap hold it upright for some kilopascals more. The
potential of the upright section is smooth there, and reached in two ways. A load in the section's plane of
symmetry is followed by a cell that keeps the plane. Under another load the curvature is imposed: the cell is
at a minimum of its energy, until the walls lose their balance at any curvature.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from calibration.sweep.design import between
from fem_reference import CellError, CellState, Load

Trace = Callable[[Sequence[Load], CellState | None], Iterator[CellState]]

# Directions softer than this fraction of the median stiffness are those in which the section gives way.
SOFT = 0.25
#: Growth of the softness, relative to the median stiffness, that tells of folded walls.
STIFFER = 0.1
# Steps at imposed curvature for one of the path's: the curvature is foreseen, and not corrected.
STEPS = 4
# Changes of (u, p) in the plane of symmetry: the projection on them.
_IN_PLANE = np.diag([0.0, 1.0, 0.0, 1.0, 0.5, 0.5])
_IN_PLANE[4, 5] = _IN_PLANE[5, 4] = 0.5


def upright_states(trace: Trace, start: CellState, loads: Sequence[Load]) -> Iterator[tuple[Load, CellState]]:
    """Yield states near those of free bending under loads, as long as the walls keep their balance.

    Parameters
    ----------
    trace : continuation of the cell.
    start : last state before the section's loss of stability, under an external moment.
    loads : pressures and moments of the path that are left.

    Yields
    ------
    load and state, `STEPS` for each of the path's. The state has the load's pressures, and its moment differs
        from the load's: in the plane by what the step before did not foresee, and aside by what holds the
        section upright.
    """
    for load in _divided(start.load, loads):
        held = Load(load.pressure, curvature=foreseen_curvature(start, load))
        try:
            state = next(trace([held], start))
        except CellError:
            return
        if state.jumped or state.stable is False or _leaned_over(start, state):
            return
        yield load, state
        start = state


def states_in_plane(
    trace: Trace, start: CellState, loads: Sequence[Load]
) -> Iterator[tuple[Load, CellState]]:
    """Yield states under loads in the plane of symmetry, of a cell that keeps it.

    Parameters
    ----------
    trace : continuation of the symmetric cell.
    start : last state of the whole cell before the section's loss of stability.
    loads : pressures and moments of the path that are left, in the plane.

    Yields
    ------
    load and state. Its Hessian is that in the plane; across the plane it is the start's.
    """
    across = start.hessian - _IN_PLANE @ start.hessian @ _IN_PLANE
    state = start
    for load in loads:
        try:
            state = next(trace([load], state))
        except CellError:
            return
        if state.jumped or state.stable is False:
            return
        yield load, replace(state, hessian=_IN_PLANE @ state.hessian @ _IN_PLANE + across)


def _divided(start: Load, loads: Sequence[Load]) -> Iterator[Load]:
    """Yield the loads of a path with those between them."""
    for load in loads:
        yield from (between(start, load, n / STEPS) for n in range(1, STEPS))
        yield load
        start = load


def only_gives_way(state: CellState) -> bool:
    """Whether a state is unstable in one direction alone, in which the section bends away."""
    return state.stable is False and not state.jumped and state.negative_directions == 1


def _leaned_over(before: CellState, after: CellState) -> bool:
    """Whether walls have folded to one side: a section that gave way more and more is stiffer again."""
    softness = []
    for state in (before, after):
        value = np.linalg.eigvalsh(state.hessian[:3, :3])
        softness.append(float(value[0] / np.median(value)))
    first, now = softness
    return first < SOFT and now > first + STIFFER


def foreseen_curvature(state: CellState, load: Load) -> tuple[float, float, float]:
    """Return the curvature that a state's Hessian foresees under another load [1/m].

    It does not change in directions in which the section gives way (`SOFT`).
    """
    stiffness, coupling = state.hessian[:3, :3], state.hessian[:3, 3:]
    pressure = np.asarray(load.pressure) - np.asarray(state.pressure)
    wanted = np.asarray(load.moment or (0.0, 0.0, 0.0)) - state.moment
    value, frame = np.linalg.eigh(stiffness)
    compliance = np.where(value < SOFT * np.median(value), 0.0, 1.0 / value)
    change = frame @ (compliance * (frame.T @ (wanted - coupling @ pressure)))
    first, second, third = (np.asarray(state.curvature) + change).tolist()
    return first, second, third
