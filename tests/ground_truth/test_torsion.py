"""Torsional stiffness of the laws that ship, against the limit of fine meshes: within 10 %."""

from typing import Any

import numpy as np
import pytest

import rodmodel
from calibration.truth import layout_of
from rodmodel.io import find_among
from tests.benchmark.refinement.limits import limit
from tests.benchmark.refinement.meshes import WINDINGS
from tests.benchmark.refinement.report import gathered
from tests.benchmark.refinement.solve import ONE, TWO
from tests.unit.rodmodel.sections import section_at

STUDY = gathered(None)
BAR = 0.10
six = pytest.mark.xfail(strict=True, reason="−17 to 14 %: few fine states, few of them twist")


def cases() -> list[Any]:
    """Windings of the study, with each calibration that serves them."""
    found = []
    for name, meshes in STUDY.items():
        if all(limit(meshes, "chamber 1", kpa, "torsion") is None for kpa in ONE):
            continue
        own = layout_of(WINDINGS[name].winding)
        for calibration in rodmodel.shipped_calibrations():
            layout = calibration.layout
            alike = layout.name == own.name and layout.pitch == pytest.approx(own.pitch)
            if alike and (layout.psi is None or layout.psi == pytest.approx(own.psi)):
                of = "of any psi" if layout.psi is None else "of its own"
                marks = [six] if name == "six helices" else []
                found.append(pytest.param(name, calibration, id=f"{name} {of}", marks=marks))
    return found


@pytest.mark.parametrize(("name", "calibration"), cases())
def test_it_is_that_of_the_limit_along_one_chamber_and_two(
    name: str, calibration: rodmodel.Calibration
) -> None:
    """`limit` has an interval of 1 to 8 %; its middle is taken."""
    own = layout_of(WINDINGS[name].winding)
    assert own.psi is not None
    rod = rodmodel.CoreRod.of(find_among([calibration], own.name, own.psi, own.pitch))
    off = []
    for path, pressures, chambers in (("chamber 1", ONE, (1, 0, 0)), ("chambers 1+2", TWO, (1, 1, 0))):
        for kpa in pressures:
            known, pressure = limit(STUDY[name], path, kpa, "torsion"), 1e3 * kpa * np.array(chambers)
            if known is not None and calibration.domain.covers_pressure(pressure):
                free = rod.solve_many(pressure=pressure)["free_curvature"][0]
                off.append(abs(known.error(section_at(rod.handle, free, pressure).stiffness[2, 2])))
    assert len(off) >= 7
    assert max(off) < BAR, off
