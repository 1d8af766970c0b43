"""A run directory remembers every command that it was run by, and is whole after any fault."""

import json
from dataclasses import asdict, replace

import pytest

from calibration.sweep import CellTracer, RunError, RunPlan, open_run
from fem_reference import LEVELS, ActuatorGeometry, Design, Load
from rodmodel import Domain
from tests.faults import full_disk, killed_at_every_write
from tests.fem_fixtures import TINY

PLAN = RunPlan(Design(), "coarse", Domain((6e4, 5e4, 5e4), 9e4, 2e-3), 10, seed=0, end_compliance=0.23e-3)


def test_a_run_with_more_paths_adds_its_command_and_one_that_is_taken_up_does_not(tmp_path):
    for paths, command in ((10, "run --paths 10"), (10, "run --paths 10"), (20, "run --paths 20")):
        found = open_run(tmp_path, replace(PLAN, paths=paths), command, {})
    assert found["command"] == "run --paths 10; run --paths 20"
    assert json.loads((tmp_path / "run.json").read_text()) == found


def test_a_run_that_is_taken_up_by_other_code_says_so(tmp_path, monkeypatch):
    for version in ("one", "one", "two"):
        monkeypatch.setattr("calibration.sweep.run_directory.code_version", lambda version=version: version)
        found = open_run(tmp_path, PLAN, "run --paths 10", {})
    assert found["code_version"] == "one; two"
    assert found["command"] == "run --paths 10"


@pytest.mark.parametrize(
    ("walls", "mirror"), [((0.1, 0.0, 0.0), True), ((0.0, 0.1, 0.0), False), ((0.1, 0.1, 0.1), True)]
)
def test_a_run_tells_walls_that_differ_and_the_symmetry_that_they_leave(walls, mirror):
    plan = replace(PLAN, actuator=Design(geometry=ActuatorGeometry(outer_wall_variation=walls)))
    told = json.loads(json.dumps(plan.description()))
    assert told["mirror"] is mirror
    assert told["geometry"]["outer_wall_variation"] == list(walls)
    assert "outer_wall_variation" not in PLAN.description()["geometry"]


def test_a_law_of_all_orientations_wants_equal_walls():
    actuator = Design(geometry=ActuatorGeometry(outer_wall_variation=(0.1, 0.0, 0.0)))
    with pytest.raises(ValueError, match=r"^geometry: got an outer_wall_variation of \(0.1, 0.0, 0.0\)"):
        replace(PLAN, actuator=actuator, orientations=(0.0, 1.0))


def test_a_run_of_another_plan_is_refused(tmp_path):
    open_run(tmp_path, PLAN, "run", {})
    with pytest.raises(RunError, match="holds a run with seed 0, this one has 1"):
        open_run(tmp_path, replace(PLAN, seed=1), "run --seed 1", {})


def test_a_mesh_of_ones_own_is_kept_by_its_counts_and_another_refused(tmp_path):
    own = replace(PLAN, level=TINY)
    found = open_run(tmp_path, own, "run", {})
    assert found["mesh"] == asdict(TINY)
    assert open_run(tmp_path, own, "run", {})["mesh"] == found["mesh"]
    for other in ("coarse", replace(TINY, outer_arc=6)):
        with pytest.raises(RunError, match=r"holds a run with mesh \{'inner_arc': 2.*, this one has"):
            open_run(tmp_path, replace(PLAN, level=other), "run", {})


def test_a_mesh_by_its_name_and_by_its_counts_is_the_same(tmp_path):
    open_run(tmp_path, PLAN, "run", {})
    assert open_run(tmp_path, replace(PLAN, level=LEVELS["coarse"]), "run", {})["mesh"] == "coarse"


def test_a_mesh_without_a_name_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(ValueError, match="elements: got 'absent'"):
        open_run(tmp_path / "run", replace(PLAN, level="absent"), "run", {})
    assert not (tmp_path / "run" / "run.json").exists()


def test_a_cell_is_built_on_a_mesh_of_ones_own():
    trace = CellTracer(PLAN.actuator, TINY)()
    (state,) = trace([Load((1e3, 0.0, 0.0))], None)
    assert state.curvature[1] < 0.0


@pytest.mark.parametrize(
    "content", [b"[1,2]", b"null", b"\xff\xfe{}", b"", b'{"seed": 0', b'{"seed": NaN}', b"{}"]
)
def test_a_damaged_description_is_told_by_its_name(tmp_path, content):
    open_run(tmp_path, PLAN, "run", {})
    (tmp_path / "run.json").write_bytes(content)
    with pytest.raises(RunError, match=r"^--out: .*run\.json: .*got .*, expected") as caught:
        open_run(tmp_path, PLAN, "run", {})
    assert "\n" not in str(caught.value)
    assert (tmp_path / "run.json").read_bytes() == content


def test_a_full_disk_leaves_the_old_description(tmp_path):
    open_run(tmp_path, PLAN, "run", {})
    before = (tmp_path / "run.json").read_bytes()
    with full_disk(100), pytest.raises(OSError, match="too large"):
        open_run(tmp_path, PLAN, "run again", {})
    assert (tmp_path / "run.json").read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["run.json"]


def test_a_kill_between_any_two_writes_leaves_a_run_that_is_taken_up(tmp_path, monkeypatch):
    def begin(attempt):
        return open_run(tmp_path / str(attempt), PLAN, "run", {})

    def resume(attempt):
        assert begin(attempt)["command"] == "run"
        assert [file.name for file in (tmp_path / str(attempt)).iterdir()] == ["run.json"]

    assert killed_at_every_write(monkeypatch, begin, resume) >= 4
