"""What files say of a mesh level leads back to it."""

import json
import re
from dataclasses import asdict, replace

import pytest

from fem_reference import LEVELS, RecordError, level_from_record, level_record
from tests.fem_fixtures import QUADRATIC, TINY


@pytest.mark.parametrize("level", [*LEVELS.values(), TINY, QUADRATIC])
def test_a_level_comes_back_from_json(level):
    assert level_from_record(json.loads(json.dumps(level_record(level))), "file") == level


@pytest.mark.parametrize("name", LEVELS)
def test_a_name_and_its_counts_are_told_alike(name):
    assert level_record(name) == level_record(replace(LEVELS[name])) == name


@pytest.mark.parametrize(
    ("record", "told"),
    [
        ("absent", "file: elements: got 'absent', expected one of coarse"),
        (None, "file: got None, expected a JSON object"),
        ({}, "file: inner_arc: got nothing, expected a whole number from 1 to 1000"),
        (asdict(TINY) | {"outer_arc": 2.5}, "file: outer_arc: got 2.5"),
        (
            asdict(TINY) | {"axial_size": 0.0},
            "file: axial_size: got 0.0, expected a number from 0.001 to 1000 mm",
        ),
        (asdict(TINY) | {"order": True}, "file: order: got True"),
    ],
)
def test_what_is_no_level_is_refused(record, told):
    with pytest.raises(RecordError, match=f"^{re.escape(told)}"):
        level_from_record(record, "file")
