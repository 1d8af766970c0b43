"""Angles on several meshes: what they say of the sweep's errors."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from calibration.from_design import Meshes
from calibration.from_design.mesh_check import MeshCheck, check_meshes, check_pressures, is_close
from calibration.sweep import inside
from fem_reference import Design
from rodmodel import Domain

CHECK = MeshCheck(((30e3, 0.0, 0.0), (0.0, 20e3, 20e3)), (1.01, 1.98), (1.0, 2.0), (1.0, 1.8), 0.5)


def test_the_error_is_that_to_the_finer_mesh():
    """Of one chamber, and of two; of three the larger of both."""
    assert [CHECK.error(n) for n in (1, 2, 3)] == pytest.approx([0.01, 0.01, 0.01])
    assert replace(CHECK, sweep=(1.01, 2.06)).error(3) == pytest.approx(0.03)


def test_the_ratio_carries_an_actuators_angle_to_the_sweeps_mesh():
    assert [CHECK.ratio(n) for n in (1, 2)] == pytest.approx([1.01, 1.1])
    assert CHECK.ratio(3) == pytest.approx(1.055)


def test_a_mesh_that_did_not_converge_is_unknown_in_a_file_too():
    """JSON has no NaN."""
    open_ = replace(CHECK, finer=(1.0, math.nan))
    again = MeshCheck.of(json.loads(json.dumps(open_.record(), allow_nan=False)))
    assert again.error(1) == open_.error(1)
    assert math.isnan(again.error(2))
    assert math.isnan(again.error(3))
    assert MeshCheck.of(CHECK.record()) == CHECK


@pytest.mark.parametrize(
    ("angles", "close"),
    [((1.0, 2.0), True), ((0.986, 2.029), True), ((1.0, 2.04), False), ((1.0, math.nan), False)],
)
def test_a_mesh_is_close_if_both_its_angles_are(angles, close):
    """Within 1.5 %, at both loads."""
    assert is_close(angles, (1.0, 2.0)) is close


@pytest.mark.parametrize(("of_cheaper", "chosen"), [(1.01, True), (1.04, False)])
def test_the_cheaper_mesh_is_the_sweeps_if_it_is_close_to_the_finer(of_cheaper, chosen, monkeypatch):
    """Then the sweep's own is not computed at all."""
    angles = {"coarse": of_cheaper, "fine": 0.998, "finer": 1.0}
    asked = []

    def found(_design, level, _compliance, _pressures):
        asked.append(level)
        return (angles[level], 1.5 * angles[level]), {"coarse": 2.0, "fine": 10.0, "finer": 60.0}[level]

    monkeypatch.setattr("calibration.from_design.mesh_check._angles", found)
    meshes = Meshes("coarse", "fine", "finer", "coarse", cheaper="coarse")
    check = check_meshes(Design(), Domain((60e3,) * 3, 110e3, 1.0), meshes, 0.0)
    assert check.cheaper is chosen
    assert check.sweep[0] == (of_cheaper if chosen else 0.998)
    assert check.seconds == (2.0 if chosen else 10.0)
    assert ("fine" in asked) is not chosen
    assert MeshCheck.of(check.record()) == check


@pytest.mark.parametrize(
    "domain", [Domain((60e3,) * 3, 110e3, 1.0), Domain((60e3, 50e3, 50e3), 80e3, 1.0, 1.0, 0.5, 60e3)]
)
def test_meshes_are_compared_inside_the_domain(domain):
    pressures = check_pressures(domain)
    assert inside(domain, np.array(pressures), np.zeros((2, 3))).all()
    assert pressures[0][0] == 0.75 * domain.pressure_max[0]
