"""The table of mesh ratios: what the refinement study's states make of it, and the one that ships."""

import pytest

from calibration.truth import ONE_CHAMBER, SHIPPED_LIMITS, load_limits
from tests.benchmark.refinement.limits import limit
from tests.benchmark.refinement.mesh_table import OF_LEVELS, ratios
from tests.benchmark.refinement.report import gathered
from tests.benchmark.refinement.solve import UPRIGHT_PATH, Solved

QUADRATIC = {"quadratic x1": 61.0, "quadratic x2": 60.8, "quadratic-2 x1": 60.6}


def solved(winding: str, mesh: str, angle: float) -> Solved:
    volumes = {f"volume_{k}": k * angle for k in (1, 2, 3)}
    state = {"pressure_kpa": [40.0, 0.0, 0.0], "angle_deg": angle, "torsion": 2.0 * angle, **volumes}
    return Solved(winding, mesh, 1, 1, {"chamber 1": [state], "chambers 1+2": []})


def test_a_ratio_is_the_limit_over_the_value_on_the_mesh():
    meshes = {
        name: solved("psi 90", name, angle)
        for name, angle in {**QUADRATIC, "linear x1": 59.0, "linear x2": 59.6, "linear-2 x2": 60.2}.items()
    }
    interval = limit(meshes, "chamber 1", 40.0, "angle_deg")
    assert interval is not None
    coarse, layered = ratios({"psi 90": meshes})
    assert (coarse.mesh, layered.mesh, coarse.path) == ("coarse", "layered", ONE_CHAMBER)
    assert coarse.pressure == (40e3,)
    assert coarse.layout.psi == pytest.approx(1.5707963)
    assert (coarse.least[0], coarse.most[0]) == pytest.approx((interval.least / 59.0, interval.most / 59.0))
    change = 1e-6 * (0.5 * (interval.least + interval.most) - 59.0)
    assert coarse.volume_change[0] == pytest.approx((change, 2.0 * change, 3.0 * change))
    assert layered.least[0] == pytest.approx(interval.least / 59.6)
    assert coarse.torsion == ((pytest.approx(coarse.least[0]), pytest.approx(coarse.most[0])),)


def test_rings_on_the_coarse_mesh_are_no_mesh_of_the_study():
    """Three layers from ring to ring: the middle one holds the ring."""
    names = {*OF_LEVELS.values(), "linear-2 x2", *QUADRATIC}
    meshes = {name: solved("rings", name, 60.0) for name in names}
    assert {row.mesh for row in ratios({"rings": meshes})} == {"layered", "fine", "finer"}


def upright(mesh: str, angle: float) -> Solved:
    """The paper's winding at 40 and 55 kPa, and in its plane at 55 and 60 kPa, a degree more at each."""
    base = solved("psi 0", mesh, angle)
    (state,) = base.states["chamber 1"]
    rows = {
        path: [{**state, "pressure_kpa": [p, 0.0, 0.0], "angle_deg": angle + more} for p, more in states]
        for path, states in (
            ("chamber 1", ((40.0, 0.0), (55.0, 9.0))),
            (UPRIGHT_PATH, ((55.0, 1.0), (60.0, 2.0))),
        )
    }
    return base.joined(Solved("psi 0", mesh, 1, 1, rows))


def test_high_pressures_are_those_of_the_cell_that_is_held_upright():
    angles = {**QUADRATIC, "linear x1": 59.0, "linear-2 x2": 60.2}
    meshes = {name: upright(name, angle) for name, angle in angles.items()}
    (row,) = ratios({"psi 0": meshes})
    assert row.pressure == (40e3, 55e3, 60e3)
    for k, (path, pressure, value) in enumerate(
        (("chamber 1", 40.0, 59.0), (UPRIGHT_PATH, 55.0, 60.0), (UPRIGHT_PATH, 60.0, 61.0))
    ):
        interval = limit(meshes, path, pressure, "angle_deg")
        assert interval is not None
        assert (row.least[k], row.most[k]) == pytest.approx((interval.least / value, interval.most / value))


def test_a_winding_without_a_limit_has_no_row():
    assert ratios({"psi 0": {"linear x1": solved("psi 0", "linear x1", 63.0)}}) == []


def test_the_table_that_ships_is_that_of_the_record():
    assert load_limits(SHIPPED_LIMITS).ratios == tuple(ratios(gathered(None)))
