"""Measurements of another actuator, in other units, or too few: each is said, and ends with status 3."""

import csv
import json

import numpy as np
import pytest

import rodmodel
from calibration.cli import main
from calibration.measured import ANGLE, PLANE, POSITIONS, PRESSURES, Measured
from calibration.measured.doubts import doubts_of_units

OUTPUTS = (ANGLE, PLANE, *POSITIONS)
CHAMBERS = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.6, 0), (0, 0.6, 0.6), (0.6, 0, 0.6)])


@pytest.fixture(scope="module")
def core():
    return rodmodel.load_core("double-helix")


def of_map(core, gain=1.0, levels=(10.0, 20.0, 30.0, 40.0)):
    """What the map's actuator does at `gain` times the pressures that are read."""
    pressure = 1e3 * np.concatenate([np.outer(levels, chamber) for chamber in CHAMBERS])
    solved = core.solve_many(pressure=gain * pressure)
    assert np.all(solved["result"] == 0)
    values = np.column_stack([solved["bending_angle"], solved["bending_plane"], solved["tip_position"]])
    return pressure, values


def measured(pressure, values, outputs=OUTPUTS):
    return Measured(pressure, outputs, values, None, None, tuple(range(2, 2 + len(pressure))))


@pytest.mark.parametrize("gain", [0.7, 1.0, 1.2])
def test_a_moulding_of_the_maps_actuator_is_in_no_doubt(core, gain):
    pressure, values = of_map(core, gain, (10.0, 20.0, 30.0))
    assert doubts_of_units(core, measured(pressure, values)) is None


@pytest.mark.parametrize(
    ("unit", "kpa"), [("MPa", 1e3), ("bar", 100.0), ("psi", 6.895), ("mmHg", 0.1333), ("mbar", 0.1)]
)
@pytest.mark.parametrize("outputs", [OUTPUTS, (ANGLE,), POSITIONS, ("tip_x_mm", "tip_z_mm")])
def test_a_unit_of_pressure_is_guessed(core, unit, kpa, outputs):
    pressure, values = of_map(core)
    columns = [OUTPUTS.index(name) for name in outputs]
    told = doubts_of_units(core, measured(pressure / kpa, values[:, columns], outputs))
    assert f"are the pressures in {unit}, {kpa:g} kPa each?" in told


@pytest.mark.parametrize(
    ("column", "factor", "told"),
    [
        (ANGLE, np.pi / 180.0, "radians"),
        (POSITIONS, 1e-3, "m:"),
        (POSITIONS, 0.1, "cm"),
        (POSITIONS, 1 / 25.4, "inch"),
    ],
)
def test_a_unit_of_what_was_measured_is_guessed(core, column, factor, told):
    pressure, values = of_map(core)
    scales = [factor if name in np.atleast_1d(column) else 1.0 for name in OUTPUTS]
    assert told in doubts_of_units(core, measured(pressure, values * scales))


def test_a_softer_actuator_is_another_one(core):
    pressure, values = of_map(core)
    told = doubts_of_units(core, measured(pressure / 5.0, values))
    assert "bends so far at" in told
    assert "it is another actuator than the map's, which needs a calibration of its own" in told
    assert " in " not in told.split(":")[1]


def test_a_straight_rod_at_no_pressure_is_in_no_doubt(core):
    at_rest = core.solve((0.0, 0.0, 0.0)).tip_position
    values = np.concatenate([[0.0, 0.0], at_rest])
    assert doubts_of_units(core, measured(np.zeros((3, 3)), np.tile(values, (3, 1)))) is None


def write(file, pressure, values, outputs=OUTPUTS):
    units = [1e3 if name in POSITIONS else 57.29577951 for name in outputs]
    with file.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow([*PRESSURES, *outputs])
        writer.writerows(np.concatenate([1e-3 * pressure, values * units], axis=1).tolist())


def ended(file, capsys, *arguments):
    out = file.parent / "mine.json"
    status = main(["fit-measured", str(file), "--out", str(out), *arguments])
    printed = capsys.readouterr()
    return status, printed, out.exists()


@pytest.mark.parametrize("arguments", [(), ("--estimate-noise",)])
def test_the_command_ends_with_3_before_it_fits_another_actuator(core, tmp_path, capsys, arguments):
    pressure, values = of_map(core)
    write(tmp_path / "data.csv", pressure / 5.0, values)
    status, printed, written = ended(tmp_path / "data.csv", capsys, *arguments)
    assert status == 3
    assert printed.out == ""
    assert not written
    assert printed.err.count("\n") == 1
    assert "it is another actuator" in printed.err
    assert "nothing written: --force goes on" in printed.err


def test_too_few_states_end_with_3_however_often_they_are_repeated(core, tmp_path, capsys):
    pressure, values = (np.repeat(rows[3:4], 8, axis=0) for rows in of_map(core))
    write(tmp_path / "data.csv", pressure, values)
    status, printed, written = ended(tmp_path / "data.csv", capsys, "--json")
    assert status == 3
    assert not written
    record = json.loads(printed.out)
    assert (record["rows"], record["states"], record["converged"]) == (8, 1, False)
    assert record["doubts"] == ["one state was measured, repeats not counted: expected 3 at least"]
    assert record["doubts"][0] in printed.err
    assert "no calibration written: --force writes it" in printed.err


@pytest.mark.slow
def test_swapped_columns_end_with_3_and_where_forced_are_written_with_what_speaks_against(
    core, tmp_path, capsys
):
    pressure, values = of_map(core)
    # Chambers 1 and 2 alone, 1 and 3 nearly as strong: angles fit, planes do not.
    rows = np.flatnonzero((pressure > 0).sum(axis=1) == 1)
    outputs = (ANGLE, PLANE)
    write(tmp_path / "data.csv", pressure[rows][:, [1, 0, 2]], values[rows, :2], outputs)
    status, printed, written = ended(tmp_path / "data.csv", capsys, "--json")
    assert status == 3
    assert not written
    doubts = json.loads(printed.out)["doubts"]
    assert any("of the measured values, expected at most 20 %" in doubt for doubt in doubts), doubts
    status, printed, written = ended(tmp_path / "data.csv", capsys, "--json", "--force")
    assert status == 0
    assert written
    assert all(doubt in printed.err for doubt in doubts)
    note = rodmodel.read_calibration(tmp_path / "mine.json").provenance["adjustment"]
    assert note["forced_against"] == json.loads(printed.out)["doubts"]


def test_planes_alone_tell_no_error_of_the_angle(core, tmp_path, capsys):
    pressure, values = of_map(core)
    write(tmp_path / "data.csv", pressure, values[:, 1:2], (PLANE,))
    status, printed, written = ended(tmp_path / "data.csv", capsys)
    assert (status, written) == (2, False)
    assert (
        "--out: got measurements of bending_plane_deg, expected bending_angle_deg, or all of" in printed.err
    )


@pytest.mark.slow
def test_a_fit_that_does_not_converge_is_doubted_and_has_no_intervals(core, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("calibration.measured.fit._EVALUATIONS", 2)
    pressure, values = of_map(core, 1.1, (10.0, 30.0))
    write(tmp_path / "data.csv", pressure, values)
    status, printed, written = ended(tmp_path / "data.csv", capsys, "--json", "--force")
    assert (status, written) == (0, True)
    record = json.loads(printed.out)
    assert "least squares did not converge in 2 evaluations" in record["doubts"]
    assert all(part["interval_95"] in (None, [None, None]) for part in record["parameters"])
