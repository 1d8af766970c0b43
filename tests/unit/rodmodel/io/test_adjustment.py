"""A calibration adjusted to an actuator of one's own is a calibration, of exactly the adjusted potential."""

import copy
import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import rodmodel
from rodmodel import CalibrationFileError, CalibrationNotFoundError, Domain
from rodmodel.core import CoreRod
from rodmodel.io import (
    ADJUSTMENT_RANGES,
    Adjustment,
    Calibration,
    Found,
    OuterWall,
    adjusted,
    find,
    find_among,
    ranges_table,
    read_calibration,
    save_calibration,
)
from tests.unit.rodmodel import calibrations
from tests.unit.rodmodel.core.test_law_data import handle_of, potential, section

ROOT = Path(__file__).parents[4]
MINE = Adjustment(
    1.3, np.array([1.05, 0.9, 0.97]), np.array([600.0, -400.0, 300.0]), np.array([0.15, 0.0, -0.3])
)
TWELVE = math.radians(12.0)


def of_map(tmp_path: Path, kind: str, psi: float) -> Found:
    made = {
        "mirror": calibrations.calibration,
        "none": calibrations.of_twelve_degrees,
        "all": calibrations.oriented_calibration,
    }[kind]()
    save_calibration(made, tmp_path / "map.json")
    return find("double-helix", psi, 3e-3, tmp_path / "map.json")


def core_section(made: Calibration, psi: float, u: np.ndarray, p: np.ndarray) -> dict[str, Any]:
    from rodmodel.core import law_data

    found = find_among([made], "double-helix", psi, 3e-3)
    return section(handle_of(made, law_data(made.law, found.turns, found.mirrored)), u, p)


@pytest.mark.parametrize(
    ("kind", "psi"),
    [("mirror", 0.0), ("mirror", 4.0 * math.pi / 3.0), ("none", TWELVE), ("none", -TWELVE), ("all", 0.7)],
)
def test_the_potential_is_that_of_the_map_at_the_pressures_that_it_sees(
    tmp_path: Path, kind: str, psi: float
):
    found = of_map(tmp_path, kind, psi)
    made = adjusted(found, MINE, {}, {})
    save_calibration(made, tmp_path / "mine.json")
    again = read_calibration(tmp_path / "mine.json")
    law = found.calibration.law
    base = CoreRod.of(found)
    rng = np.random.default_rng(1)
    for _ in range(4):
        u, p = rng.normal(size=3) * [20.0, 20.0, 4.0], rng.random(3) * 40e3
        seen = MINE.pressure_gain * p + MINE.pressure_offset
        wanted = section(base.handle, u, seen)
        walls = MINE.wall_stiffness()
        came = core_section(again, psi, u, p)
        energy = 1.3 * (wanted["energy"] + 0.5 * u @ walls @ u)
        assert came["energy"] == pytest.approx(energy, rel=1e-12)
        scale = np.abs(came["moment"]).max()
        np.testing.assert_allclose(
            came["moment"], 1.3 * (wanted["moment"] + walls @ u), rtol=0, atol=1e-13 * max(scale, 1e-2)
        )
        np.testing.assert_allclose(came["stiffness"], 1.3 * (wanted["stiffness"] + walls), atol=1e-16)
        np.testing.assert_allclose(came["volume"], 1.3 * MINE.pressure_gain * wanted["volume"], rtol=1e-12)
    if kind == "none" and psi > 0.0:
        # Against the formula itself, in NumPy.
        energy = potential(law, u, seen)
        assert wanted["energy"] == pytest.approx(energy, rel=1e-12)


def test_the_compiled_rod_and_the_differentiable_one_agree_on_a_file(tmp_path: Path):
    save_calibration(adjusted(of_map(tmp_path, "mirror", 0.0), MINE, {}, {}), tmp_path / "mine.json")
    for load in ((0.0, 0.0, 0.0), (20e3, 5e3, 9e3)):
        compiled = rodmodel.load_core("double-helix", path=tmp_path / "mine.json").solve(load)
        reference = rodmodel.load("double-helix", path=tmp_path / "mine.json").solve(np.array(load))
        np.testing.assert_allclose(compiled.tip_position, reference.tip_position, atol=1e-11)
    # With offsets the rod is bent where nothing is read.
    nothing = rodmodel.load_core("double-helix", path=tmp_path / "mine.json").solve((0.0, 0.0, 0.0))
    assert nothing.bending_angle > 1e-3


def test_its_chambers_may_be_numbered_anew_and_its_rods_stacked(tmp_path: Path):
    file = tmp_path / "mine.json"
    save_calibration(adjusted(of_map(tmp_path, "mirror", 0.0), MINE, {}, {}), file)
    load, third = np.array([20e3, 5e3, 9e3]), 2.0 * math.pi / 3.0
    wanted = rodmodel.load_core("double-helix", path=file).solve(load)
    turned = rodmodel.load_core("double-helix", third, path=file).solve(np.roll(load, 1))
    assert turned.bending_angle == pytest.approx(wanted.bending_angle, rel=1e-10)
    of_jax = [rodmodel.load("double-helix", psi, path=file) for psi in (0.0, third)]
    of_jax.append(rodmodel.load("double-helix", path=tmp_path / "map.json"))
    rods = rodmodel.stack(of_jax)
    angles = eqx.filter_vmap(lambda rod: rod.solve(jnp.asarray(np.roll(load, 1)), throw=False).bending_angle)(
        rods
    )
    assert angles[1] == pytest.approx(turned.bending_angle, rel=1e-9)
    of_map_alone = rodmodel.load_core("double-helix", path=tmp_path / "map.json").solve(np.roll(load, 1))
    assert angles[2] == pytest.approx(of_map_alone.bending_angle, rel=1e-9)


def test_an_adjustment_of_an_adjustment_is_one_after_the_other(tmp_path: Path):
    first = adjusted(of_map(tmp_path, "mirror", 0.0), MINE, {}, {})
    save_calibration(first, tmp_path / "first.json")
    second = adjusted(find("double-helix", 0.0, 3e-3, tmp_path / "first.json"), MINE, {}, {})
    u, p = np.array([3.0, -14.0, 2.0]), np.array([20e3, 5e3, 9e3])
    inner = core_section(first, 0.0, u, MINE.pressure_gain * p + MINE.pressure_offset)
    came = core_section(second, 0.0, u, p)
    np.testing.assert_allclose(
        came["moment"], 1.3 * (inner["moment"] + MINE.wall_stiffness() @ u), rtol=1e-12
    )
    assert came["energy"] == pytest.approx(
        1.3 * (inner["energy"] + 0.5 * u @ MINE.wall_stiffness() @ u), rel=1e-12
    )


def test_domain_and_ends_are_those_of_the_adjusted_actuator(tmp_path: Path):
    found = of_map(tmp_path, "mirror", 0.0)
    of_ends = dataclasses.replace(found.calibration.actuator, base_turn=1e-6, base_stiffness=2e-4)
    base = Calibration(
        layout=found.calibration.layout,
        actuator=of_ends,
        law=found.calibration.law,
        domain=found.domain,
        error={**found.calibration.error, "actuator_angle_rad": {"p90": 0.01}},
        provenance={"by": "hand"},
    )
    made = adjusted(dataclasses.replace(found, calibration=base), MINE, {"more": 1}, {"base": "map.json"})
    first, second, third = found.domain.pressure_max
    assert made.domain == Domain(
        ((first - 600.0) / 1.05, (second + 400.0) / 0.9, (third - 300.0) / 0.97),
        (found.domain.pressure_sum_max - 500.0) / 1.05,
        1.3 * found.domain.moment_max,
        1.3 * found.domain.moment_max,
    )
    assert made.actuator.base_stiffness == 1.3 * 2e-4
    assert made.provenance == {"by": "hand", "adjustment": {"base": "map.json"}}
    assert made.error["more"] == 1


def test_pressures_of_the_adjusted_domain_are_inside_the_map() -> None:
    """With equal gains and no offsets, all that are."""
    limited = dataclasses.replace(
        calibrations.DOMAIN,
        beside_share=4.0 / 7.0,
        beside_max=79e3,
        single_max=(75e3, 0.0, 72e3),
        single_beside=5e3,
    )
    random = np.random.default_rng(3)
    pressure = random.uniform(0.0, 80e3, (20_000, 3))
    # Half of them with one chamber nearly alone.
    pressure[::2] *= np.where(np.eye(3)[random.integers(0, 3, 10_000)] > 0.0, 1.0, 0.1)
    alike = dataclasses.replace(MINE, pressure_gain=np.full(3, 1.1), pressure_offset=np.zeros(3))
    for adjustment in (MINE, alike):
        inside = adjustment.domain(limited).covers_pressure(pressure.T)
        read = adjustment.pressure_gain * pressure + adjustment.pressure_offset
        in_map = limited.covers_pressure(read.T)
        assert np.all(in_map[inside])
        assert np.mean(inside[in_map]) > 0.7
    np.testing.assert_array_equal(inside, in_map)
    plain = dataclasses.replace(limited, single_max=(0.0, 0.0, 0.0), single_beside=0.0)
    assert np.sum(in_map & ~plain.covers_pressure(read.T)) > 100


def test_offsets_beyond_the_pressure_beside_leave_no_chamber_alone() -> None:
    """Read as nothing, a chamber beside has more than the map allows."""
    limited = dataclasses.replace(calibrations.DOMAIN, single_max=(75e3, 0.0, 0.0), single_beside=0.5e3)
    assert MINE.domain(limited) == MINE.domain(calibrations.DOMAIN)


def test_offsets_that_leave_nothing_beside_are_refused() -> None:
    made = calibrations.calibration()
    limited = dataclasses.replace(made.domain, beside_share=1.0, beside_max=2e3)
    found = find_among([dataclasses.replace(made, domain=limited)], "double-helix", 0.0, 3e-3)
    with pytest.raises(ValueError, match=r"pressure_offset: got .* expected offsets that leave pressures"):
        adjusted(found, dataclasses.replace(MINE, pressure_offset=np.full(3, 1e3)), {}, {})


@pytest.mark.parametrize(("p90", "expected"), [(0.2, 0.2), (0.001, math.hypot(0.016, 0.01))])
def test_the_error_is_what_was_measured_and_never_less_than_the_maps(
    tmp_path: Path, p90: float, expected: float
):
    figures = {"actuator_angle_rad": {"p90": 0.01}, "measured_angle_rad": {"p90": p90}}
    save_calibration(adjusted(of_map(tmp_path, "mirror", 0.0), MINE, figures, {}), tmp_path / "mine.json")
    rod = rodmodel.load_core("double-helix", path=tmp_path / "mine.json")
    assert rod.error_bound.largest_angle == pytest.approx(expected, rel=1e-12)
    assert rod.solve((10e3, 0.0, 0.0)).error_estimate >= expected


def test_an_adjusted_actuator_serves_no_mirror_image(tmp_path: Path):
    made = adjusted(of_map(tmp_path, "none", TWELVE), MINE, {}, {})
    save_calibration(made, tmp_path / "mine.json")
    assert find("double-helix", TWELVE, 3e-3, tmp_path / "mine.json").turns == 0
    with pytest.raises(CalibrationNotFoundError, match="psi 12 deg and every 60 deg from it"):
        find("double-helix", -TWELVE, 3e-3, tmp_path / "mine.json")


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"pressure_gain": np.array([1.0, 0.0, 1.0])}, "pressure_gain: got .* expected positive"),
        ({"pressure_gain": np.ones(2)}, "pressure_gain: got .* expected three finite"),
        ({"wall_variation": np.array([0.0, math.nan, 0.0])}, "wall_variation: got .* three finite"),
        ({"stiffness_scale": -1.0}, "stiffness_scale: got -1.0, expected a positive number"),
    ],
)
def test_numbers_that_no_actuator_has_are_refused(change: dict[str, Any], told: str):
    with pytest.raises(ValueError, match=told):
        dataclasses.replace(MINE, **change)


def test_offsets_that_leave_no_pressure_are_refused(tmp_path: Path):
    beyond = dataclasses.replace(MINE, pressure_offset=np.array([0.0, 90e3, 0.0]))
    with pytest.raises(ValueError, match=r"pressure_offset: got .* expected offsets that leave"):
        adjusted(of_map(tmp_path, "mirror", 0.0), beyond, {}, {})


def test_a_law_with_symmetry_is_no_adjusted_one():
    with pytest.raises(ValueError, match="symmetry: got 'mirror', expected none in an adjusted law"):
        dataclasses.replace(calibrations.ridge_arrays(), quadratic=np.zeros(6))


OLD: dict[str, Any] = {
    "schema": "rodmodel-adjustment",
    "version": 1,
    "layout": {"name": "double-helix", "psi_rad": 0.0, "pitch_m": 3e-3},
    "wall": {"radius_m": 5.5e-3, "thickness_m": 1e-3, "shear_modulus_pa": 0.1e6},
    "parameters": {
        "stiffness_scale": 1.3,
        **{f"pressure_gain_{k + 1}": gain for k, gain in enumerate((1.05, 0.9, 0.97))},
        **{f"pressure_offset_{k + 1}_pa": offset for k, offset in enumerate((600.0, -400.0, 300.0))},
        **{f"wall_variation_{k + 1}": part for k, part in enumerate((0.15, 0.0, -0.3))},
    },
    "standard_errors": {"stiffness_scale": None},
    "provenance": {"command": "rodmodel-calibrate fit-measured data.csv"},
}


def test_a_file_of_the_release_before_is_read_with_a_warning(tmp_path: Path):
    file = tmp_path / "old.json"
    file.write_text(json.dumps(OLD))
    with pytest.warns(FutureWarning, match=r"old\.json: an adjustment file, which the next release"):
        came = read_calibration(file)
    wanted = adjusted(find("double-helix", 0.0, 3e-3), MINE, {}, {})
    u, p = np.array([3.0, -14.0, 2.0]), np.array([20e3, 5e3, 9e3])
    for name, value in core_section(wanted, 0.0, u, p).items():
        np.testing.assert_array_equal(core_section(came, 0.0, u, p)[name], value)
    assert came.domain == wanted.domain
    assert came.provenance["adjustment"]["command"] == "rodmodel-calibrate fit-measured data.csv"


REMOVED = object()


@pytest.mark.parametrize(
    ("keys", "value", "told"),
    [
        ("version", 2, "version: got 2, expected version 1"),
        ("layout", None, "layout: got None, expected a JSON object"),
        ("layout.name", "knot", "layout: got 'knot', expected "),
        ("wall.radius_m", 5.5e3, "wall.radius_m: got 5500.0, expected a number from 1e-06 to 10 m"),
        ("parameters.stiffness_scale", 0, "parameters.stiffness_scale: got 0, expected a number from 0.01"),
        ("parameters.pressure_gain_2", REMOVED, "parameters.pressure_gain_2: got nothing, expected a number"),
        ("parameters.pressure_offset_1_pa", "6", "parameters.pressure_offset_1_pa: got '6', expected a"),
        ("parameters.pressure_offset_1_pa", 9e7, "pressure_offset: got [90000000.0"),
        ("parameters.wall_variation_3", math.nan, "parameters.wall_variation_3: got NaN, expected a finite"),
        ("standard_errors", [1], "standard_errors: got [1], expected a JSON object"),
        ("provenance", REMOVED, "provenance: got nothing, expected an object"),
    ],
)
def test_a_malformed_file_is_refused_in_one_line_with_file_and_key(
    tmp_path: Path, keys: str, value: Any, told: str
):
    content = copy.deepcopy(OLD)
    *path, last = keys.split(".")
    place = content
    for key in path:
        place = place[key]
    if value is REMOVED:
        del place[last]
    else:
        place[last] = value
    file = tmp_path / "old.json"
    file.write_text(json.dumps(content))
    with pytest.raises(CalibrationFileError) as caught:
        read_calibration(file)
    assert str(caught.value).startswith(f"{file}: {told}")
    assert str(caught.value).isprintable()


def test_the_manual_has_the_ranges_of_adjustment_files():
    assert (
        ranges_table(ADJUSTMENT_RANGES) in (ROOT / "docs" / "reference" / "calibration_file.md").read_text()
    )


def test_the_walls_close_to_a_ring():
    wall = OuterWall()
    ring = np.pi * wall.shear_modulus * wall.thickness * wall.radius**3 * np.diag([3.0, 3.0, 2.0])
    np.testing.assert_allclose(wall.stiffness().sum(axis=0), ring, rtol=1e-12, atol=1e-18)
