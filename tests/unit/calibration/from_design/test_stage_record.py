"""Results of stages on file: used again for the same inputs, and for no others."""

import json

import pytest

from calibration.from_design.stage_record import kept, key_of


class Counting:
    """A stage that counts how often it runs."""

    def __init__(self, fails=0):
        self.runs, self.fails = 0, fails

    def __call__(self):
        self.runs += 1
        if self.runs <= self.fails:
            raise KeyboardInterrupt
        return {"value": 3.0, "pair": (1, 2)}


def test_a_stage_runs_once_for_the_same_inputs(tmp_path):
    """And gives the same as when it ran: what JSON makes of its result."""
    stage = Counting()
    first = kept(tmp_path, "stage", {"level": "coarse", "chambers": (1, 2)}, stage)
    again = kept(tmp_path, "stage", {"level": "coarse", "chambers": [1, 2]}, stage)
    assert stage.runs == 1
    assert first == again == {"value": 3.0, "pair": [1, 2]}


def test_other_inputs_run_it_again(tmp_path):
    stage = Counting()
    for level in ("coarse", "fine", "fine"):
        kept(tmp_path, "stage", {"level": level}, stage)
    assert stage.runs == 2


@pytest.mark.parametrize("content", ["", "{", "[]", '{"inputs": {"level": "coarse"}}'])
def test_a_damaged_file_is_no_result(tmp_path, content):
    stage = Counting()
    kept(tmp_path, "stage", {"level": "coarse"}, stage)
    (tmp_path / "stage.json").write_text(content)
    assert kept(tmp_path, "stage", {"level": "coarse"}, stage)["value"] == 3.0
    assert stage.runs == 2


def test_an_interrupted_stage_leaves_no_result_and_runs_again(tmp_path):
    stage = Counting(fails=1)
    with pytest.raises(KeyboardInterrupt):
        kept(tmp_path, "stage", {}, stage)
    assert not (tmp_path / "stage.json").exists()
    assert kept(tmp_path, "stage", {}, stage)["value"] == 3.0


def test_a_file_tells_when_and_of_which_code_it_is(tmp_path):
    kept(tmp_path, "stage", {"level": "coarse"}, Counting())
    record = json.loads((tmp_path / "stage.json").read_text())
    assert {"stage", "code_version", "date", "seconds", "inputs", "result"} == set(record)


def test_keys_tell_inputs_apart():
    assert key_of({"a": 1, "b": 2}) == key_of({"b": 2, "a": 1}) != key_of({"a": 1, "b": 3})
