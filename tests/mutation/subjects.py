"""Modules that faults are put into, and the tests that are to find them."""

from typing import NamedTuple


class Subject(NamedTuple):
    """A module of equations, and the fewest fast tests that claim all of it, the quickest first."""

    module: str
    tests: tuple[str, ...]


_SECTION = "tests/unit/rodmodel/section"
_STATICS = "tests/unit/rodmodel/statics"

# The core's C99 has no row: each fault would need a compilation of all its copies. Its equations are those of
# the rows below, and tests/verification/rodmodel/test_core_against_reference.py compares the two.
SUBJECTS = {
    "equilibrium": Subject("rodmodel/statics/_equilibrium.py", (f"{_STATICS}/test_equilibrium.py",)),
    "ridge-law": Subject("rodmodel/section/_ridges.py", (f"{_SECTION}/test_ridge_network.py",)),
    "ridge-network": Subject("rodmodel/section/_ridge_network.py", (f"{_SECTION}/test_ridge_network.py",)),
    "cell": Subject("fem_reference/cell/equations.py", ("tests/unit/fem_reference/cell/test_equations.py",)),
}
