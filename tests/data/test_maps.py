"""The laws that ship keep what is asked of a map: by their files' figures, which `report` finds again."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import calibration
import rodmodel
from calibration.fit import deviations, prepare
from calibration.fit.held_out_error import NO_MOMENT
from calibration.report.all_layouts import datasets_by_checksum, on_its_mesh
from calibration.sweep import load_dataset

LAWS = {
    f"{c.layout.name} psi {c.layout.psi} pitch {1e3 * c.layout.pitch:g}": c
    for c in rodmodel.shipped_calibrations()
}
# Held out: 95 % and worst of the free bending angle [deg]; 95 % of moment and volume over their ranges.
ANGLE, WORST, MOMENT, VOLUME = 0.5, 2.0, 0.01, 0.01
# Of a law of a finer mesh, which is fitted near another to a fifth of the states.
MOMENT_NEAR = 0.015
ANY, HALF_PI, SIX = (
    "double-helix psi None pitch 3",
    "double-helix psi 1.5707963267948966 pitch 3",
    "six-helix psi 0.0 pitch 3",
)
WIDE = "double-helix psi 0.0 pitch 4"
RINGS = "ring psi 0.0 pitch 3"
# Beyond their bars: fitted to 700 to 2000 states of the fine mesh, too few where the section leans: free
# bending of 0.77° for any ψ and 0.87° at ψ = 90°, at worst 5.7° within six helices, whose moments are off by
# 2.2 %. Or fitted to the whole range of a single chamber, which 64 ridges hold less well than half
# of it: free bending of 0.51° at a pitch of 4 mm, and 0.54° within rings.
too_few = pytest.mark.xfail(strict=True, reason="too few states of the fine mesh")
too_wide = pytest.mark.xfail(strict=True, reason="64 ridges for the whole range of a chamber alone")


def laws(**marks: tuple[str, ...]) -> list[Any]:
    """All laws, some of them marked as too few or too wide."""
    mark = {"too_few": too_few, "too_wide": too_wide}
    of = {name: mark[kind] for kind, names in marks.items() for name in names}
    return [pytest.param(name, marks=of[name]) if name in of else name for name in LAWS]


@pytest.mark.parametrize("name", laws(too_few=(ANY, HALF_PI), too_wide=(WIDE, RINGS)))
def test_the_free_bending_angle_is_within_its_bar_at_95_percent(name: str) -> None:
    assert math.degrees(LAWS[name].error["free_bending_angle_rad"]["p95"]) <= ANGLE


@pytest.fixture(scope="module")
def datasets() -> dict[str, Path]:
    return datasets_by_checksum(Path(calibration.__file__).parent / "datasets")


@pytest.mark.parametrize("name", LAWS)
def test_free_bending_is_within_the_bar_of_all_meshes(name: str, datasets: dict[str, Path]) -> None:
    """95 % of the held-out states within 1.5 % of their angle, or within 0.6°."""
    length = float(LAWS[name].actuator.body_length)
    law = on_its_mesh(LAWS[name])
    held_out = prepare(load_dataset(datasets[law.provenance["dataset_sha256"]]), law.domain, length).held_out
    free = held_out.where(np.linalg.norm(held_out.moment, axis=1) <= NO_MOMENT)
    angle = length * np.linalg.norm(free.curvature[:, :2], axis=1)
    error = deviations(law.section_law, free, length).angle
    assert np.mean(error <= np.maximum(0.015 * angle, math.radians(0.6))) >= 0.95


@pytest.mark.parametrize("name", laws(too_few=(SIX,)))
def test_the_worst_free_bending_angle_is_within_its_bar(name: str) -> None:
    assert math.degrees(LAWS[name].error["free_bending_angle_rad"]["worst"]) <= WORST


@pytest.mark.parametrize("name", laws(too_few=(SIX,)))
def test_the_moment_is_within_its_bar_at_95_percent(name: str) -> None:
    moment = LAWS[name].error["moment_nm"]
    bar = MOMENT if LAWS[name].provenance["mesh"] == "coarse" else MOMENT_NEAR
    assert moment["p95"] <= bar * moment["range"]


@pytest.mark.parametrize("name", LAWS)
def test_the_volume_is_within_its_bar_at_95_percent(name: str) -> None:
    volume = LAWS[name].error["volume_m2"]
    assert volume["p95"] <= VOLUME * volume["range"]


@pytest.mark.parametrize("name", laws(too_few=(SIX,)))
def test_the_moment_is_within_the_bar_of_all_meshes(name: str) -> None:
    """1.5 % of its range, of the laws of the whole range too."""
    moment = LAWS[name].error["moment_nm"]
    assert moment["p95"] <= MOMENT_NEAR * moment["range"]


@pytest.mark.parametrize("name", LAWS)
def test_a_file_states_what_its_ends_err_by(name: str) -> None:
    """Of runs left out one after the other, as `rodmodel-calibrate ends` writes it."""
    known = LAWS[name].error["actuator_angle_rad"]
    assert 0.0 < known["median"] <= known["p90"] <= known["worst"] < 0.1
    assert LAWS[name].provenance["ends"]["command"].startswith("rodmodel-calibrate ends ")


@too_few
def test_the_law_of_all_orientations_errs_within_twice_what_those_of_one_do() -> None:
    """Its held-out paths are at random orientations, of which none was trained on."""
    helices = [c for c in LAWS.values() if c.layout.name == "double-helix" and c.layout.pitch == 3e-3]
    (of_all,) = (c for c in helices if c.layout.psi is None)
    single = [c for c in helices if c.layout.psi is not None]
    assert len(single) == 3
    for figure in ("median", "p95", "worst"):
        for quantity in ("free_bending_angle_rad", "moment_nm", "volume_m2"):
            best = min(c.error[quantity][figure] for c in single)
            assert of_all.error[quantity][figure] <= 2.0 * best
