"""The file of a path: what is told is on the disk, and damage is told by file and line."""

import json
import os

import pytest
from manufactured_cell import ManufacturedTracer

from calibration.sweep import LoadingPath
from calibration.sweep.path_file import PathFileError, PathWriter, read_path
from calibration.sweep.tracing import trace_path
from fem_reference import Load
from tests.faults import full_disk, killed_at_every_write

PATH = LoadingPath("ramp", "train", tuple(Load((2e3 * k, 0.0, 0.0), (0.0, 0.0, 0.0)) for k in range(1, 5)))


@pytest.fixture(scope="module")
def records():
    return [record | {"seconds": 1.0} for record in trace_path(ManufacturedTracer()(), PATH)]


@pytest.fixture
def file(tmp_path, records):
    PathWriter(tmp_path / "ramp.jsonl").add(records)
    return tmp_path / "ramp.jsonl"


def test_each_record_is_on_the_disk_before_the_next_is_taken(tmp_path, records, monkeypatch):
    file, synced = tmp_path / "ramp.jsonl", []
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append(len(read_path(file).states)))
    writer = PathWriter(file)
    for record in records[:3]:
        writer.add([record])
    # The folder first, which has a new name.
    assert synced == [0, 1, 2, 3]


def test_a_kill_between_any_two_writes_leaves_a_file_that_is_finished_by_the_next(
    file, tmp_path, records, monkeypatch
):
    def write(attempt):
        PathWriter(tmp_path / str(attempt) / "ramp.jsonl").add(records)

    def resume(attempt):
        write(attempt)
        assert (tmp_path / str(attempt) / "ramp.jsonl").read_bytes() == file.read_bytes()

    assert killed_at_every_write(monkeypatch, write, resume) >= len(records)


def test_a_full_disk_keeps_the_records_before_and_the_next_run_goes_on(file, tmp_path, records):
    cut = tmp_path / "cut.jsonl"
    room = file.stat().st_size // 2
    with full_disk(room), pytest.raises(OSError, match="too large"):
        PathWriter(cut).add(records)
    kept = read_path(cut)
    assert kept.end is None
    assert 0 < len(kept.states) < len(PATH.loads)
    PathWriter(cut).add(records)
    assert cut.read_bytes() == file.read_bytes()


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda line: b"[1, 2]", "got [1, 2], expected a JSON object"),
        (lambda line: b"null", "got None, expected a JSON object"),
        (lambda line: b"\xff\x00", "expected a JSON object"),
        (lambda line: line[:40], "expected a JSON object"),
        (lambda line: b"", "expected a JSON object"),
        (lambda line: changed(line, energy=float("nan")), "energy: got nan, expected a number"),
        (lambda line: changed(line, pressure=[1.0]), "pressure: got [1.0], expected 3 numbers"),
        (lambda line: b'{"end": []}', "end: got [], expected a JSON object"),
        (lambda line: b'{"end": {}}', "end.attempts: got nothing"),
    ],
)
def test_a_damaged_line_is_told_by_file_and_line(file, damage, told):
    lines = file.read_bytes().split(b"\n")
    lines[1] = damage(lines[1])
    file.write_bytes(b"\n".join(lines))
    for read in (read_path, PathWriter):
        with pytest.raises(PathFileError) as caught:
            read(file)
        assert str(caught.value).startswith(f"{file}, line 2: ")
        assert told in str(caught.value)
        assert "\n" not in str(caught.value)


def changed(line: bytes, **values) -> bytes:
    return json.dumps({**json.loads(line), **values}).encode()
