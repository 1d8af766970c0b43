"""The law of one actuator is that of all similar ones: rods bend alike, and files hold the scaled numbers."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from calibration.similar import Scale, scaled
from calibration.similar.scaled import _ACTUATOR
from rodmodel import (
    Actuator,
    load_branches,
    load_core,
    read_calibration,
    save_calibration,
    shipped_calibrations,
)
from rodmodel.io import Jump
from tests.unit.rodmodel import calibrations

# Rounding of some thousand operations, and of the curvatures at which an iteration stops (1e-10).
ALIKE = 1e-9
# With this density the weight scales as the moduli's forces do.
SCALE = Scale(length=3.0, modulus=0.25, density=0.25 / 3.0)


@pytest.fixture(scope="module", params=["double-helix", "ring"])
def shipped(request):
    """A law that ships, of a pitch of 3 mm at ψ = 0."""
    known = [c for c in shipped_calibrations() if c.layout.name == request.param]
    return next(c for c in known if c.layout.psi in (0.0, None) and c.layout.pitch == 3e-3)


@pytest.fixture
def rod_of(tmp_path):
    """The rod of a calibration, by its file."""

    def made(calibration):
        file = tmp_path / "law.json"
        save_calibration(calibration, file)
        return load_core(calibration.layout.name, 0.0, calibration.layout.pitch, file)

    return made


def test_all_numbers_of_an_actuator_are_scaled():
    assert {field.name for field in fields(Actuator)} == set(_ACTUATOR)


def test_a_scaled_rod_bends_alike(shipped, rod_of):
    rng = np.random.default_rng(0)
    count = 20
    pressure = 30e3 * rng.random((count, 3))
    force = 0.02 * rng.standard_normal((count, 3))
    gravity = np.tile([0.0, 9.81, 0.0], (count, 1))
    own = rod_of(shipped).solve_many(pressure=pressure, tip_force=force, gravity=gravity, volumes=True)
    other = rod_of(scaled(shipped, SCALE, {})).solve_many(
        pressure=0.25 * pressure, tip_force=0.25 * 9.0 * force, gravity=gravity, volumes=True
    )
    assert (own["result"] == 0).all()
    np.testing.assert_array_equal(other["result"], own["result"])
    np.testing.assert_array_equal(other["in_domain"], own["in_domain"])
    np.testing.assert_allclose(other["bending_angle"], own["bending_angle"], rtol=ALIKE)
    np.testing.assert_allclose(other["tip_position"], 3.0 * own["tip_position"], rtol=0, atol=ALIKE * 0.2)
    np.testing.assert_allclose(other["chamber_volume"], 27.0 * own["chamber_volume"], rtol=ALIKE)
    np.testing.assert_allclose(other["angle_error"], own["angle_error"], rtol=ALIKE)


def test_there_and_back_is_the_file_as_it_was(shipped, tmp_path):
    back = scaled(scaled(shipped, SCALE, {}), Scale(1 / 3.0, 4.0, 12.0), shipped.provenance)
    save_calibration(back, tmp_path / "back.json")
    read = read_calibration(tmp_path / "back.json")
    np.testing.assert_allclose(read.law.pressure_scale, shipped.law.pressure_scale, rtol=1e-14)
    assert read.layout.pitch == pytest.approx(shipped.layout.pitch, rel=1e-14)
    assert read.domain.moment_max == pytest.approx(shipped.domain.moment_max, rel=1e-14)
    for name in ("free_bending_angle_rad", "moment_nm", "volume_m2"):
        assert read.error[name]["p95"] == pytest.approx(shipped.error[name]["p95"], rel=1e-14)
        assert read.error[name]["states"] == shipped.error[name]["states"]


def test_errors_keep_angles_and_scale_the_rest(shipped):
    found = scaled(shipped, SCALE, {}).error
    assert found["free_bending_angle_rad"]["p95"] == shipped.error["free_bending_angle_rad"]["p95"]
    assert found["moment_nm"]["worst"] == pytest.approx(0.25 * 27.0 * shipped.error["moment_nm"]["worst"])
    assert found["volume_m2"]["median"] == pytest.approx(9.0 * shipped.error["volume_m2"]["median"])
    own, other = (error["moment_nm"]["worst_at"] for error in (shipped.error, found))
    assert other["pressure_pa"] == pytest.approx([0.25 * p for p in own["pressure_pa"]])
    assert other["path"] == own["path"]


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.inf, math.nan])
def test_a_ratio_that_is_none_is_refused(wrong):
    with pytest.raises(ValueError, match="modulus: got"):
        Scale(1.0, wrong)


def test_snapped_branches_are_scaled_too(tmp_path):
    files = [tmp_path / name for name in ("own.json", "other.json")]
    own = calibrations.with_snapped((2, 1))
    for calibration, file in zip((own, scaled(own, SCALE, {})), files, strict=True):
        save_calibration(calibration, file)
    here, there = (
        load_branches("double-helix", 0.0, pitch, file)
        for pitch, file in zip((own.layout.pitch, 3.0 * own.layout.pitch), files, strict=True)
    )
    for kpa, branch in ((55.0, "snapped"), (65.0, "auto"), (55.0, "loading")):
        pressure = 1e3 * np.array([2.0, kpa, 4.0])
        one, other = here.solve(pressure, branch=branch), there.solve(0.25 * pressure, branch=branch)
        assert (other.branch, other.other_possible) == (one.branch, one.other_possible)
        assert other.solution.in_domain
        np.testing.assert_allclose(other.solution.bending_angle, one.solution.bending_angle, rtol=ALIKE)
        np.testing.assert_allclose(
            other.solution.tip_position, 3.0 * one.solution.tip_position, rtol=0, atol=ALIKE * 0.2
        )


def test_pressures_of_jumps_are_scaled_too():
    jumps = (Jump(2, 60e3, 65e3, "chamber2", "coarse"), Jump(3, 70e3, None, "chamber3", "fine"))
    found = scaled(replace(calibrations.calibration(), jumps=jumps), SCALE, {}).jumps
    assert found == (Jump(2, 15e3, 16.25e3, "chamber2", "coarse"), Jump(3, 17.5e3, None, "chamber3", "fine"))
