"""Least and largest principal stretch of the silicone in a state of the cell, beside those of its tests."""

from fem_reference.cell.period_cell import CellState, PeriodCell


def extreme_stretches(cell: PeriodCell, state: CellState) -> tuple[float, float]:
    """Return the least and the largest principal stretch at all Gauss points.

    Parameters
    ----------
    cell, state : the cell and one of its states.
    """
    equations = cell.equations
    return equations.solid.extreme_stretches(equations.all_positions(state.configuration))


def largest_stretch(cell: PeriodCell, state: CellState) -> float:
    """Return the largest principal stretch at all Gauss points; see `extreme_stretches`."""
    return extreme_stretches(cell, state)[1]


def stretch_beyond_tests(cell: PeriodCell, state: CellState) -> str | None:
    """Return how a state leaves the stretch of the material's tests; None if it does not, or none is known.

    A tension test up to λ covers compression down to 1/λ, which planar tension has across, or down to the
    least stretch of a compression test.
    """
    tested = cell.material.stretch_range
    if tested is None:
        return None
    least, largest = extreme_stretches(cell, state)
    shortest = min(tested[0], 1.0 / tested[1])
    if largest > tested[1]:
        return f"a stretch of {largest:.3g} in the silicone, which was tested up to {tested[1]:.3g}"
    if least < shortest:
        return f"a stretch of {least:.3g} in the silicone, which was tested down to {shortest:.3g}"
    return None
