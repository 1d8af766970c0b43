"""Modules that faults are put into, and the tests that are to find them."""

from typing import NamedTuple


class Subject(NamedTuple):
    """A module of equations, and the fewest fast tests that claim all of it, the quickest first."""

    module: str
    tests: tuple[str, ...]
    without: str | None = None
    """Word in the names of those among the tests that are not run."""


_STATICS = "tests/unit/rodmodel/statics"
_NETWORK = "tests/unit/rodmodel/section/test_ridge_network.py::test_"
_CELL_TESTS = "tests/unit/fem_reference/cell/test_equations"
_CELL = (f"{_CELL_TESTS}.py", f"{_CELL_TESTS}_in_plane.py")

# The core's C99 has no row: each fault would need a compilation of all its copies. Its equations are those of
# the rows below, and tests/verification/rodmodel/test_core_against_reference.py compares the two.
SUBJECTS = {
    "equilibrium": Subject("rodmodel/statics/_equilibrium.py", (f"{_STATICS}/test_equilibrium.py",)),
    # The law at one pressure knows nothing of symmetry.
    "ridge-law": Subject(
        "rodmodel/section/_ridge_law.py",
        (
            f"{_NETWORK}the_potential_is_its_formula[none]",
            f"{_NETWORK}moment_volume_and_stiffness_are_slopes[none]",
            f"{_NETWORK}the_moment_vanishes_at_the_free_curvature[none]",
            f"{_NETWORK}the_free_curvature_has_the_slopes_of_a_root[mirror]",
            f"{_NETWORK}a_root_that_is_many_steps_away_is_found",
            f"{_NETWORK}a_law_without_a_root_says_so",
        ),
    ),
    "ridge-network": Subject(
        "rodmodel/section/_ridge_network.py",
        (
            f"{_NETWORK}arrays_that_do_not_fit_and_impossible_scales_are_refused",
            f"{_NETWORK}the_potential_is_its_formula",
            f"{_NETWORK}the_moment_vanishes_at_the_free_curvature[full]",
            f"{_NETWORK}potential_moment_and_free_curvature_vanish_at_rest[mirror]",
            f"{_NETWORK}laws_of_one_size_can_be_stacked",
        ),
    ),
    # Quadratic elements take most of the time, to compile, and the cell's equations are the same for them.
    "cell": Subject("fem_reference/cell/equations.py", _CELL, without="quadratic"),
    "cell-unknowns": Subject("fem_reference/cell/unknowns.py", _CELL, without="quadratic"),
}
