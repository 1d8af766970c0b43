"""A sweep loses nothing: over processes, kills and failures."""

import json

import numpy as np
import pytest
from distributed import LocalCluster
from manufactured_cell import ManufacturedTracer, potential

from calibration.sweep import LoadingPath, SweepError, run_sweep
from calibration.sweep.path_file import PathWriter, read_path
from calibration.sweep.tracing import HALVINGS, RETRY_SUBDIVISION, trace_path
from fem_reference import Load


def ramp(name="ramp", pressure=(20e3, 5e3, 0.0), moment=(1e-4, 0.0, 2e-4), steps=8):
    shares = np.arange(1, steps + 1) / steps
    loads = tuple(
        Load(pressure=tuple((s * np.array(pressure)).tolist()), moment=tuple((s * np.array(moment)).tolist()))
        for s in shares
    )
    return LoadingPath(name, "train", loads)


def trace_into(file, tracer=None, path=None):
    """What a worker finds on a path, in its file."""
    tracer = ManufacturedTracer() if tracer is None else tracer
    PathWriter(file).add(trace_path(tracer(), ramp() if path is None else path))


PATHS = [ramp("a"), ramp("b", pressure=(0.0, 30e3, 3e3)), ramp("c", pressure=(1e3, 1e3, 1e3), steps=3)]


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """Run directory and records of a sweep by two processes."""
    directory = tmp_path_factory.mktemp("swept")
    return directory, run_sweep(ManufacturedTracer(), PATHS, directory, workers=2)


def test_two_processes_trace_every_load_of_every_path_once(swept):
    _, records = swept
    for path in PATHS:
        record = records[path.name]
        assert record.end == {"attempts": 1}
        assert [tuple(state["pressure"]) for state in record.states] == [load.pressure for load in path.loads]
        assert [tuple(state["applied_moment"]) for state in record.states] == [
            load.moment for load in path.loads
        ]


def test_recorded_numbers_are_those_of_the_potential(tmp_path):
    trace_into(tmp_path / "ramp.jsonl")
    for state in read_path(tmp_path / "ramp.jsonl").states:
        energy = potential(np.array(state["curvature"]), np.array(state["pressure"]))
        assert state["energy"] == pytest.approx(float(energy), rel=1e-13)
        # Newton stops at a residual of 1e-14 N m.
        assert state["moment"] == pytest.approx(state["applied_moment"], abs=1e-14)


@pytest.mark.parametrize("left_of_a_line", ["", '{"pressure": [1.0, 2'])
def test_a_killed_path_keeps_its_states_and_is_finished_by_the_next_run(tmp_path, left_of_a_line):
    file = tmp_path / "ramp.jsonl"
    trace_into(file)
    whole = read_path(file)
    lines = file.read_text().splitlines(keepends=True)
    marked = json.loads(lines[1]) | {"seconds": -1.0}  # tells a kept state from one that was found again
    file.write_text(lines[0] + json.dumps(marked) + "\n" + lines[2] + left_of_a_line)
    assert read_path(file).end is None
    assert len(read_path(file).states) == 3

    trace_into(file)
    again = read_path(file)
    assert again.end == {"attempts": 1}
    assert again.states[1]["seconds"] == -1.0
    assert [state["curvature"] for state in again.states] == [state["curvature"] for state in whole.states]


def test_finished_paths_are_left_alone(swept):
    directory, records = swept
    before = {file: (file.read_bytes(), file.stat().st_mtime_ns) for file in (directory / "paths").iterdir()}
    assert len(before) == len(PATHS)
    assert run_sweep(ManufacturedTracer(), PATHS, directory, workers=1) == records
    after = {file: (file.read_bytes(), file.stat().st_mtime_ns) for file in (directory / "paths").iterdir()}
    assert after == before


def test_a_path_that_cannot_go_on_keeps_its_states_and_says_where_it_ended(tmp_path):
    file = tmp_path / "ramp.jsonl"
    trace_into(file, ManufacturedTracer(fails_beyond=14e3))  # 25 kPa at the end: 3.1 kPa a step
    record = read_path(file)
    assert record.failed
    assert "no step to" in record.end["failure"]
    assert record.end["attempts"] == 2
    reached = sum(record.end["reached"]["pressure"])
    assert reached == pytest.approx(max(sum(state["pressure"]) for state in record.states))
    # The retry goes in quarters of a step, so it ends less than one of them before the limit.
    assert 14e3 - 25e3 / 8 / RETRY_SUBDIVISION < reached <= 14e3


@pytest.mark.parametrize(
    ("tracer", "found"),
    [(ManufacturedTracer(snaps_beyond=14e3), 4), (ManufacturedTracer(saddle_beyond=14e3), 5)],
)
def test_a_path_ends_where_stability_is_lost(tmp_path, tracer, found):
    """At 15.6 kPa, the fifth load. A saddle is on file, a snap leaves nothing; neither is tried again.

    Before the snap, states at imposed curvature follow in shorter steps.
    """
    file = tmp_path / "ramp.jsonl"
    trace_into(file, tracer)
    record = read_path(file)
    assert record.lost_stability
    assert not record.failed
    assert record.end["attempts"] == 1
    free = [state["pressure"] for state in record.states if not state["held"]]
    assert free == [list(x.pressure) for x in ramp().loads[:found]]
    assert max(sum(state["pressure"]) for state in record.states if state["stable"] == 1) <= 14e3
    assert record.end["unstable"]["pressure"] == record.states[-1]["pressure"]


def test_a_path_ends_where_neighbouring_states_do_not_explain_each_other(tmp_path):
    """A step over a snap, from one stable branch to another, is halved twice; then the path ends."""
    file = tmp_path / "ramp.jsonl"
    trace_into(file, ManufacturedTracer(silent_snap_beyond=14e3))
    record = read_path(file)
    assert record.lost_stability
    step = sum(ramp().loads[0].pressure)
    last = sum(record.states[-1]["pressure"])
    assert 14e3 - step / 2**HALVINGS < last <= 14e3 < sum(record.end["unstable"]["pressure"])


def test_states_lie_closer_where_the_section_changes_quickly(tmp_path):
    """From 30 to 60 kPa there is a quick change of slope: the step is halved until neighbours agree."""
    file = tmp_path / "ramp.jsonl"
    path = ramp(pressure=(60e3, 0.0, 0.0), steps=2)
    trace_into(file, path=path)
    record = read_path(file)
    assert record.end == {"attempts": 1}
    pressures = [state["pressure"][0] for state in record.states]
    assert pressures == sorted(pressures)
    assert 45e3 in pressures
    assert {load.pressure[0] for load in path.loads} <= set(pressures)


def test_a_state_is_kept_while_those_between_are_found():
    """No load is solved for twice, and the path goes on where it was."""
    asked, trace = [], ManufacturedTracer()()

    def counted(loads, start):
        for state in trace(loads, start):
            asked.append(state.load)
            yield state

    path = ramp(pressure=(80e3, 0.0, 0.0), steps=3)
    *states, end = trace_path(counted, path)
    assert end == {"end": {"attempts": 1}}
    assert len(asked) == len(set(asked)) == len(states) > len(path.loads)


def test_a_step_that_was_too_large_is_taken_in_smaller_ones(tmp_path):
    file = tmp_path / "ramp.jsonl"
    trace_into(file, ManufacturedTracer(largest_step=1e3))  # the ramp steps by 2.5 kPa
    record = read_path(file)
    assert record.end == {"attempts": 2}
    pressures = {tuple(state["pressure"]) for state in record.states}
    assert pressures >= {load.pressure for load in ramp().loads}
    assert {state["attempt"] for state in record.states} == {2}


def test_an_existing_cluster_traces_paths_for_a_folder_that_it_need_not_see(tmp_path, swept):
    _, alone = swept
    with LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        worker_dashboard_address="127.0.0.1:0",
    ) as cluster:
        records = run_sweep(ManufacturedTracer(), PATHS[:2], tmp_path, scheduler=cluster.scheduler_address)
    for name in ("a", "b"):
        assert records[name].end == {"attempts": 1}
        assert [s["curvature"] for s in records[name].states] == [s["curvature"] for s in alone[name].states]


def test_a_scheduler_that_does_not_answer_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("calibration.sweep.cluster._CONNECT", 0.5)
    with pytest.raises(SweepError, match=r"no scheduler answers at tcp://127\.0\.0\.1:9"):
        run_sweep(ManufacturedTracer(), [ramp()], tmp_path, scheduler="tcp://127.0.0.1:9")


def test_a_scheduler_with_tls_is_not_reached_without_the_keys(tmp_path):
    with pytest.raises(SweepError, match=r"no scheduler answers at tls://127\.0\.0\.1:9: TLS expects"):
        run_sweep(ManufacturedTracer(), [ramp()], tmp_path, scheduler="tls://127.0.0.1:9")


def test_a_path_on_which_workers_die_ends_the_sweep_and_keeps_what_was_found(tmp_path):
    paths = [ramp("a", pressure=(9e3, 0.0, 0.0), steps=3), ramp("b", pressure=(0.0, 30e3, 3e3))]
    with pytest.raises(SweepError, match=r"worker processes died on path b; finished states are in .*paths"):
        run_sweep(ManufacturedTracer(dies_beyond=20e3), paths, tmp_path, workers=1)
    assert read_path(tmp_path / "paths" / "a.jsonl").end == {"attempts": 1}
    left = read_path(tmp_path / "paths" / "b.jsonl")
    assert left.end is None
    assert 0 < len(left.states) < 8
