"""The cheapest named mesh of a winding's cell that is near the limit of refinement."""

from fem_reference.geometry import NoWinding, Ring, Winding


def converged_level(winding: Winding) -> str:
    """Return the name of the mesh level on which a cell's free bending is near its limit.

    ``python -m tests.benchmark.refinement.report`` prints how near, by winding and pressure. Rings hold the
    silicone along a whole layer, whose walls between two rings want elements of their own.
    """
    if isinstance(winding, NoWinding):
        return "coarse"
    return "finer" if isinstance(winding, Ring) else "fine"
