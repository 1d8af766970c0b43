"""Limits of the refinement study, from values with errors of known order."""

import pytest

from tests.benchmark.refinement.limits import difference, limit
from tests.benchmark.refinement.solve import Solved

TRUE = 60.0


def solved(mesh: str, angle: float) -> Solved:
    state = {"pressure_kpa": [40.0, 0.0, 0.0], "angle_deg": angle}
    return Solved("psi 0", mesh, 1, 1, {"chamber 1": [state], "chambers 1+2": []})


def family(name: str, section: float, axial: float, finest: str) -> dict[str, Solved]:
    """Values with errors of second order in the section's and the layers' size."""
    sizes = {f"{name} x1": (1.0, 1.0), f"{name} x2": (1.0, 0.5), f"{name}-2 {finest}": (0.5, 1.0)}
    if finest == "x2":
        sizes[f"{name}-2 x2"] = (0.5, 0.5)
    return {
        mesh: solved(mesh, TRUE * (1.0 + section * h**2 + axial * k**2)) for mesh, (h, k) in sizes.items()
    }


def test_errors_of_second_order_leave_the_true_limit_inside_or_at_the_end():
    both = family("linear", -0.03, -0.01, "x2") | family("quadratic", 0.02, 0.005, "x1")
    found = limit(both, "chamber 1", 40.0, "angle_deg")
    # The finest values err by a quarter of the coarse ones' errors, the extrapolated ones not at all.
    assert found.least == pytest.approx(TRUE * (1.0 - 0.04 / 4.0))
    assert found.most == pytest.approx(TRUE * (1.0 + 0.025 / 4.0))
    assert found.error(TRUE) == pytest.approx(0.0, abs=found.half_width)


def test_the_finest_quadratic_mesh_is_taken_where_it_is_solved():
    """Beyond what sections and layers add up to: by 0.5° more here."""
    both = family("linear", -0.03, -0.01, "x2") | family("quadratic", 0.02, 0.005, "x1")
    added = sum(
        both[f"quadratic{mesh}"].value("chamber 1", 40.0, "angle_deg") * sign
        for mesh, sign in ((" x2", 1.0), ("-2 x1", 1.0), (" x1", -1.0))
    )
    same = limit(both | {"quadratic-2 x2": solved("quadratic-2 x2", added)}, "chamber 1", 40.0, "angle_deg")
    before = limit(both, "chamber 1", 40.0, "angle_deg")
    assert (same.least, same.most) == pytest.approx((before.least, before.most))
    # Of the finer mesh's value and what it extrapolates to the larger one.
    higher = limit(
        both | {"quadratic-2 x2": solved("quadratic-2 x2", added + 0.5)}, "chamber 1", 40.0, "angle_deg"
    )
    assert higher.most == pytest.approx(before.most + 0.5)
    # Where it does not come so far nothing is told: its walls fold, and errors do not add up.
    lost = {"quadratic-2 x2": Solved("psi 0", "quadratic-2 x2", 1, 1, {"chamber 1": []})}
    assert limit(both | lost, "chamber 1", 40.0, "angle_deg") is None
    elsewhere = {"quadratic-2 x2": Solved("psi 0", "quadratic-2 x2", 1, 1, {"another path": []})}
    assert limit(both | elsewhere, "chamber 1", 40.0, "angle_deg") == before


@pytest.mark.parametrize("name", ["linear", "quadratic"])
def test_one_family_alone_tells_no_limit(name):
    alone = family(name, -0.03, -0.01, "x2" if name == "linear" else "x1")
    assert limit(alone, "chamber 1", 40.0, "angle_deg") is None


def test_what_two_windings_have_in_common_is_not_in_their_difference():
    """Both are wrong by the same share of nearly the same angle; one is 1° larger on every mesh."""
    more = family("linear", -0.03, -0.01, "x2") | family("quadratic", 0.02, 0.005, "x1")
    less = {name: solved(name, one.value("chamber 1", 40.0, "angle_deg") - 1.0) for name, one in more.items()}
    found = difference(more, less, "chamber 1", 40.0, "angle_deg")
    assert (found.least, found.most) == pytest.approx((1.0, 1.0))
    interval = limit(more, "chamber 1", 40.0, "angle_deg")
    assert interval.most - interval.least > 0.5


def test_without_the_finest_meshes_there_is_none():
    assert limit({"linear x1": solved("linear x1", 59.0)}, "chamber 1", 40.0, "angle_deg") is None
