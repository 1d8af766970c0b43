"""Runs of the full actuator: the cases as they are listed, and what becomes of one of them."""

import json
import math
import re
import shutil

import numpy as np
import pytest

from calibration.cli import main
from calibration.sweep import save_dataset
from calibration.truth import (
    TruthCase,
    TruthError,
    case_of,
    cases,
    gather,
    load_truth,
    merged,
    trace,
    truth_level,
)
from fem_reference import LEVELS, ActuatorLoad, DoubleHelix, Thread
from fem_reference.io import RunError
from tests.fem_fixtures import TINY

SMALL = TruthCase("small", "judge", DoubleHelix(), tuple(ActuatorLoad((p, 0.0, 0.0)) for p in (2e3, 4e3)))
#: Provenance of a run that was not made here.
NOTE = {"command": "rodmodel-calibrate truth pair23", "code_version": "unknown", "date": "2026-11-29"}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A directory with one finished run, on the fewest elements."""
    directory = tmp_path_factory.mktemp("truth")
    states = list(trace(SMALL, directory, TINY, "the command"))
    return directory, states


def test_every_case_has_a_name_of_its_own_and_a_role():
    names = [case.name for case in cases()]
    assert len(set(names)) == len(names)
    assert {case.role for case in cases()} == {"fit", "judge"}
    for case in cases():
        case.winding.refuse_overlap(Thread())


def test_no_load_is_both_fitted_and_judged():
    loads = {
        role: {(repr(case.winding), load) for case in cases() if case.role == role for load in case.loads}
        for role in ("fit", "judge")
    }
    assert not loads["fit"] & loads["judge"]
    assert len(loads["judge"]) > len(loads["fit"])


def test_the_states_that_were_found_are_gathered_in_si_units(runs):
    directory, states = runs
    found = gather(directory, [SMALL])
    assert found["case"].values.tolist() == ["small", "small"]
    assert found["role"].values.tolist() == ["judge", "judge"]
    for k, state in enumerate(states):
        row = found.isel(state=k)
        np.testing.assert_allclose(row["pressure"], state.load.pressure, rtol=1e-12)
        np.testing.assert_allclose(row["tip_position"], state.tip_position, rtol=1e-12)
        np.testing.assert_allclose(row["tip_rotation"], state.tip_rotation, rtol=1e-12)
        assert float(row["bending_angle"]) == pytest.approx(state.bending_angle, rel=1e-12)
        np.testing.assert_allclose(row["volume"], state.chamber_volume, rtol=1e-12)
        # The axis is straight at rest and hardly bent here: chords of 2 mm lie within 1e-3 mm of it.
        at_end = row["axis_position"].values[-1]
        body = np.searchsorted(state.shape.arc_length, found["station"].values[-1] - 1e-12)
        np.testing.assert_allclose(at_end, state.shape.positions[body], atol=1e-6)
    told = json.loads(found.attrs["runs"])["small"]
    assert (told["command"], told["reached"], told["loads"]) == ("the command", 2, 2)


def test_a_longer_name_is_kept_in_a_file_of_shorter_ones(runs, tmp_path):
    found = gather(runs[0], [SMALL])
    own = json.loads(found.attrs["runs"])["small"]
    short, long = (
        found.assign(case=("state", np.array([name] * 2, dtype=object))).assign_attrs(
            runs=json.dumps({name: own})
        )
        for name in ("a", "a-b")
    )
    file = tmp_path / "truth.nc"
    short.to_netcdf(file, engine="h5netcdf")
    merged(load_truth(file), long).to_netcdf(tmp_path / "both.nc", engine="h5netcdf")
    assert load_truth(tmp_path / "both.nc")["case"].values.tolist() == ["a", "a", "a-b", "a-b"]


def test_cases_come_to_those_that_a_file_has_and_take_the_place_of_their_own(runs):
    directory, _ = runs
    found = gather(directory, [SMALL])
    elsewhere = found.assign(case=("state", np.array(["chamber1", "pair23"], dtype=object)))
    own = json.loads(found.attrs["runs"])["small"]["mesh"]
    elsewhere.attrs["runs"] = json.dumps({name: {"mesh": own, **NOTE} for name in ("pair23", "chamber1")})
    both = merged(elsewhere, found)
    assert both["case"].values.tolist() == ["chamber1", "pair23", "small", "small"]
    assert list(json.loads(both.attrs["runs"])) == ["chamber1", "pair23", "small"]
    assert both.attrs["mesh"] == found.attrs["mesh"]
    np.testing.assert_array_equal(both["pressure"].values[2:], found["pressure"].values)
    anew = merged(both, found.assign(bending_angle=found["bending_angle"] + 1.0))
    np.testing.assert_array_equal(anew["case"].values, both["case"].values)
    np.testing.assert_array_equal(anew["bending_angle"].values[2:], found["bending_angle"].values + 1.0)
    np.testing.assert_array_equal(anew["bending_angle"].values[:2], both["bending_angle"].values[:2])


def test_stations_that_differ_by_rounding_are_the_same(runs):
    """As those of a release that computed them in another order. Others are refused."""
    directory, _ = runs
    found = gather(directory, [SMALL])
    shifted = found.assign_coords(station=found["station"] * (1.0 + 1e-16) + 1e-19)
    elsewhere = shifted.assign(case=("state", np.array(["pair23", "pair23"], dtype=object)))
    both = merged(elsewhere, found)
    assert both.sizes["station"] == found.sizes["station"]
    np.testing.assert_array_equal(both["axis_position"].values[-2:], found["axis_position"].values)
    np.testing.assert_array_equal(both["axis_position"].values[:2], found["axis_position"].values)
    with pytest.raises(TruthError, match="truth: got stations"):
        merged(elsewhere.assign_coords(station=2.0 * found["station"]), found)


def test_runs_on_several_meshes_each_keep_theirs(runs, tmp_path):
    directory, _ = runs
    found = gather(directory, [SMALL])
    elsewhere = found.assign(case=("state", np.array(["pair23", "pair23"], dtype=object)))
    elsewhere.attrs["runs"] = json.dumps({"pair23": {"mesh": "medium", **NOTE}})
    save_dataset(merged(elsewhere, found), tmp_path / "truth.nc")
    both = load_truth(tmp_path / "truth.nc")
    assert both.attrs["mesh"] == "several"
    assert [truth_level(both, name) for name in ("pair23", "small")] == [LEVELS["medium"], TINY]
    with pytest.raises(ValueError, match="mesh of chamber2: elements: got 'several'"):
        truth_level(both, "chamber2")


def test_a_finished_run_is_left_alone_and_another_of_its_name_refused(runs):
    directory, _ = runs
    before = (directory / "small" / "step_0001.json").stat().st_mtime_ns
    assert len(list(trace(SMALL, directory, TINY, "again"))) == 1
    assert (directory / "small" / "step_0001.json").stat().st_mtime_ns == before
    turned = TruthCase("small", "judge", DoubleHelix(math.pi / 4), SMALL.loads)
    with pytest.raises(RunError, match="another winding"):
        trace(turned, directory, TINY, "turned")


def test_nothing_to_gather_is_told(tmp_path):
    with pytest.raises(TruthError, match="no finished state"):
        gather(tmp_path)


def test_an_unknown_case_is_refused_with_the_known_ones():
    with pytest.raises(TruthError, match=r"^case: got 'chamber4', expected one of chamber1-fit, "):
        case_of("chamber4")


def test_the_command_lists_the_cases(capsys):
    assert main(["truth", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["cases"]
    assert [row["case"] for row in listed] == [case.name for case in cases()]


@pytest.mark.parametrize(
    ("arguments", "named", "came"),
    [
        (["chamber4", "--out", "runs"], "case", "chamber4"),
        (["chamber1"], "--out", "nothing"),
        (["chamber1", "--out", "runs", "--elements", "absent"], "elements", "absent"),
        (["--gather", "truth.nc", "--out", "empty"], "truth", "no finished state"),
    ],
)
def test_bad_input_is_told_in_one_line(arguments, named, came, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["truth", *arguments]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert named in told
    assert came in told


def test_a_mesh_of_ones_own_is_told_by_its_counts(runs, tmp_path):
    directory, _ = runs
    found = gather(directory, [SMALL])
    save_dataset(found, tmp_path / "truth.nc")
    assert truth_level(load_truth(tmp_path / "truth.nc"), "small") == TINY
    assert json.loads(found.attrs["mesh"])["outer_arc"] == TINY.outer_arc
    with pytest.raises(RunError, match="another mesh"):
        trace(SMALL, directory, "coarse", "on another mesh")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("run.json", b"[1,2]"),
        ("run.json", b"null"),
        ("run.json", b"\xff"),
        ("run.json", b'{"role": "fit", "winding": "", "mesh": "absent"}'),
        ("provenance.json", b""),
        ("provenance.json", b"{}"),
        ("step_0001.json", b'{"pressure_kpa": [1'),
        ("step_0002.json", b"{}"),
    ],
)
def test_a_damaged_run_is_told_by_its_file(runs, tmp_path, name, content):
    shutil.copytree(runs[0], tmp_path / "truth")
    (tmp_path / "truth" / "small" / name).write_bytes(content)
    with pytest.raises(TruthError, match=rf"^truth: .*{re.escape(name)}") as caught:
        gather(tmp_path / "truth", [SMALL])
    assert "\n" not in str(caught.value)


def _with_run(truth, run):
    return truth.assign_attrs(runs=json.dumps({"small": run}))


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda truth: truth.drop_attrs(), "mesh of small"),
        (lambda truth: truth.assign_attrs(runs="{}", mesh="{broken"), "mesh"),
        (lambda truth: _with_run(truth, {}), "runs: small"),
        (lambda truth: _with_run(truth, {"mesh": "absent", **NOTE}), "elements: got 'absent'"),
        (lambda truth: truth.assign_attrs(runs="[]"), "runs: got [], expected a JSON object"),
        (lambda truth: truth.isel(state=slice(0)), "got no states"),
        (lambda truth: truth.assign(volume=np.nan * truth["volume"]), "volume: got nan in state 0"),
        (lambda truth: truth.isel(chamber=slice(2)), "pressure: got float64 of (2, 2)"),
        (lambda truth: truth.assign(role=("state", ["a", "fit"])), "role: got 'a'"),
    ],
)
def test_a_damaged_file_is_told_in_one_line(runs, tmp_path, damage, told):
    file = tmp_path / "truth.nc"
    save_dataset(damage(gather(runs[0], [SMALL])), file)
    with pytest.raises(TruthError, match=rf"^truth: .*truth\.nc: .*{re.escape(told)}") as caught:
        load_truth(file)
    assert "\n" not in str(caught.value)
