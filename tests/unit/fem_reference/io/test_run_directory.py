"""A run's directory: whole after any fault, and damage is told by the file's name."""

import io
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from fem_reference import Actuator, ActuatorGeometry, ActuatorLoad, Design
from fem_reference.cli import main
from fem_reference.io import ActuatorRun, ActuatorSeries, RunError, draw_actuator, write_actuator_vtk
from fem_reference.mesh import LEVELS
from tests.faults import full_disk, killed_at_every_write
from tests.fem_fixtures import TINY

SHORT = ActuatorGeometry(body_length=3e-3, cap_length=2e-3)
LOADS = [ActuatorLoad((p, 0.0, 0.0)) for p in (2e3, 4e3, 6e3)]
CASE = {"case": 1}


@pytest.fixture(scope="module")
def actuator():
    return Actuator(SHORT, level=TINY)


@pytest.fixture(scope="module")
def states(actuator):
    return list(actuator.follow(LOADS))


@pytest.fixture
def solved(actuator, states, monkeypatch):
    """The actuator, whose states are not solved for again."""

    def follow(loads, start=None):
        return iter([state for state in states if state.load in loads])

    monkeypatch.setattr(actuator, "follow", follow)
    return actuator


@pytest.fixture
def directory(solved, tmp_path):
    """A finished run."""
    list(ActuatorRun(tmp_path / "run", CASE).states(solved, LOADS))
    return tmp_path / "run"


def contents(directory: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in directory.iterdir()}


def test_a_kill_between_any_two_writes_leaves_a_run_that_ends_as_one_left_alone(
    solved, directory, tmp_path, monkeypatch
):
    def run(attempt):
        list(ActuatorRun(tmp_path / str(attempt), CASE).states(solved, LOADS))

    def resume(attempt):
        run(attempt)
        assert contents(tmp_path / str(attempt)) == contents(directory)

    kills = killed_at_every_write(monkeypatch, run, resume)
    # Of run.json, three records and three checkpoints, each is begun, opened, synced, renamed.
    assert kills >= 7 * 4


def test_a_full_disk_keeps_the_steps_before_and_is_told(solved, directory, tmp_path):
    room = (directory / "state.npz").stat().st_size - 1
    cut = tmp_path / "cut"
    with (
        full_disk(room),
        pytest.raises(RunError, match=r"run: got File too large in .*cut', expected room for"),
    ):
        list(ActuatorRun(cut, CASE).states(solved, LOADS))
    kept = ActuatorRun(cut, CASE).checkpoint(solved, LOADS)[1]
    assert 0 <= kept < 3
    assert not list(cut.glob("*.part"))
    list(ActuatorRun(cut, CASE).states(solved, LOADS))
    assert contents(cut) == contents(directory)


@pytest.mark.parametrize("content", [b"[1,2]", b"null", b"\xff\xfe{}", b"", b'{"case": 1', b"[" * 100_000])
def test_a_damaged_description_is_told_by_its_name(directory, content):
    (directory / "run.json").write_bytes(content)
    with pytest.raises(
        RunError, match=r"^run: got .*run\.json: got .* expected a (JSON object|readable)"
    ) as caught:
        ActuatorRun(directory, CASE)
    assert "\n" not in str(caught.value)


def array_file() -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.zeros(3))
    return stream.getvalue()


def damaged(file: Path, **arrays) -> None:
    with np.load(file) as held:
        content = {**held, **arrays}
    np.savez(file, **content)


@pytest.mark.parametrize(
    "damage",
    [
        lambda file: file.write_bytes(b""),
        lambda file: file.write_bytes(b"no zip"),
        lambda file: file.write_bytes(file.read_bytes()[:-100]),
        lambda file: file.write_bytes(array_file()),
        lambda file: np.savez(file, step=1),
        lambda file: damaged(file, step=4),
        lambda file: damaged(file, step=0),
        lambda file: damaged(file, positions_0=np.zeros((5, 3))),
        lambda file: damaged(file, base=np.full(6, np.nan)),
        lambda file: damaged(file, heading=np.array(["a"], dtype=object)),
    ],
    ids=["empty", "no zip", "cut", "no archive", "little", "beyond", "before", "another", "nan", "object"],
)
def test_a_damaged_checkpoint_is_told_by_its_name(solved, directory, damage):
    damage(directory / "state.npz")
    run = ActuatorRun(directory, CASE)
    with pytest.raises(RunError, match=r"^run: .*state\.npz: got .*, expected a state of this run") as caught:
        list(run.states(solved, LOADS))
    assert "\n" not in str(caught.value)


def broken(record: str) -> str:
    return json.dumps({**json.loads(record), "pressure_kpa": [1.0, None, 0.0]})


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda text: text[: len(text) // 2], "expected a JSON object"),
        (lambda text: "{}", "pressure_kpa: got nothing, expected 3 numbers, each from 0 to 100000 kPa"),
        (broken, "pressure_kpa: got [1.0, None, 0.0], expected 3 numbers"),
        (lambda text: text.replace('"residual_n": ', '"residual_n": NaN, "x": '), "residual_n: got nan"),
        (lambda text: text.replace('"jumped": false', '"jumped": 0'), "expected one of false, true"),
    ],
)
def test_a_damaged_record_is_told_by_its_name(solved, directory, damage, told):
    file = directory / "step_0002.json"
    file.write_text(damage(file.read_text()))
    run = ActuatorRun(directory, CASE)
    for read in (run.records, lambda: list(run.states(solved, LOADS))):
        with pytest.raises(RunError, match=rf"^run: .*step_0002\.json: .*{re.escape(told)}"):
            read()


def test_a_step_that_is_gone_is_told(solved, directory):
    (directory / "step_0002.json").unlink()
    with pytest.raises(RunError, match="without the record of a step before 3"):
        list(ActuatorRun(directory, CASE).states(solved, LOADS))


@pytest.mark.parametrize(
    ("write", "name"),
    [
        (lambda actuator, state, file: write_actuator_vtk(actuator, state, file), "body.vtu"),
        (lambda actuator, state, file: write_actuator_vtk(actuator, state, file), "body.vtk"),
        (lambda actuator, state, file: ActuatorSeries(file).add(1, actuator, state), "body.pvd"),
        (lambda actuator, state, file: draw_actuator(actuator, state, file), "body.png"),
    ],
)
def test_a_full_disk_leaves_the_old_picture(actuator, states, tmp_path, write, name):
    file = tmp_path / name
    write(actuator, states[0], file)
    before = contents(tmp_path)
    with full_disk(100), pytest.raises(OSError, match="too large"):
        write(actuator, states[1], file)
    assert contents(tmp_path) == before


@pytest.fixture
def command(monkeypatch, capsys):
    """The command on a short body of few elements, which its flags do not offer."""
    monkeypatch.setattr("fem_reference.cli._actuator.design_of", lambda options: Design(geometry=SHORT))
    monkeypatch.setitem(LEVELS, "coarse", TINY)

    def call(*arguments):
        status = main(["actuator", "--pressure-kpa", "8", "0", "0", "--json", *map(str, arguments)])
        told = capsys.readouterr()
        return status, told.out, told.err

    return call


def test_a_resumed_command_writes_the_series_of_one_left_alone(command, tmp_path):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    for folder in (whole, cut):
        folder.mkdir()
        assert command("--run", folder / "run", "--vtk", folder / "path.pvd")[0] == 0
    # As a kill leaves it: the first step is there, its picture is cut off, the second step is not there.
    run = cut / "run"
    shutil.rmtree(run)
    first, *_ = Actuator(SHORT, level="coarse").follow([ActuatorLoad((4e3, 0.0, 0.0))])
    run.mkdir()
    shutil.copy(whole / "run" / "run.json", run)
    ActuatorRun(run, json.loads((run / "run.json").read_text()))._save(first, 1)
    for file in (*cut.glob("*.vtu"), cut / "path.pvd"):
        file.unlink()
    status, told, _ = command("--run", run, "--vtk", cut / "path.pvd")
    assert status == 0
    assert (cut / "path.pvd").read_text() == (whole / "path.pvd").read_text()
    assert sorted(file.name for file in cut.glob("*.vtu")) == ["path_0001.vtu", "path_0002.vtu"]
    again = command("--run", run, "--vtk", cut / "path.pvd")
    assert json.loads(again[1]) == json.loads(told)
    assert (cut / "path.pvd").read_text() == (whole / "path.pvd").read_text()


def test_the_command_tells_damage_and_a_full_disk_in_one_line(command, tmp_path):
    run = tmp_path / "run"
    with full_disk(10_000):
        status, _, told = command("--run", run)
    assert status == 2
    assert told.startswith("rodmodel-fem: --run: got File too large")
    assert told.count("\n") == 1
    assert command("--run", run)[0] == 0
    with full_disk(100):
        status, answer, told = command("--run", run, "--plot", tmp_path / "body.png")
    assert status == 2
    assert "--plot: got" in told
    assert told.count("\n") == 1
    assert json.loads(answer)["converged"]
    (run / "state.npz").write_bytes(b"")
    status, _, told = command("--run", run)
    assert status == 2
    assert "state.npz" in told
    assert told.count("\n") == 1


def test_ctrl_c_ends_the_command_in_one_line(command, monkeypatch):
    def interrupt(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("fem_reference.cli._actuator.track_actuator", interrupt)
    assert command() == (130, "", "rodmodel-fem: interrupted; steps in the directory of --run are kept\n")
