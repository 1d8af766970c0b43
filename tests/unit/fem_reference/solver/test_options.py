"""Options of the solvers: heuristics that the hard cases turn off, and the record of the cases."""

from dataclasses import fields, replace

import pytest

from fem_reference.solver import SolverOptions
from tests.benchmark.hard_cases.__main__ import RECORD, changed_options, recorded_outcomes
from tests.benchmark.hard_cases.cases import CASES
from tests.benchmark.hard_cases.heuristics import WITHOUT
from tests.benchmark.hard_cases.outcome import Outcome

REACHED = Outcome("reached", 60.0, 0, 20, 40, 1.0)


@pytest.mark.parametrize("name", WITHOUT)
def test_a_heuristic_is_turned_off_by_options_of_the_same_kind(name):
    options = changed_options(WITHOUT[name])
    assert options != SolverOptions()
    for group in fields(options):
        changed, default = getattr(options, group.name), getattr(SolverOptions(), group.name)
        for option in fields(changed):
            assert type(getattr(changed, option.name)) is type(getattr(default, option.name))


def test_twenty_cases_are_recorded():
    assert RECORD.exists()
    assert len(CASES) == 20
    assert list(recorded_outcomes()) == list(CASES)


@pytest.mark.parametrize(
    ("changed", "marked"),
    [
        ({}, []),
        ({"iterations": 24, "factorisations": 32, "seconds": 9.0}, []),
        ({"iterations": 25}, ["iterations"]),
        ({"factorisations": 31}, ["factorisations"]),
        ({"angle_deg": 60.0 * (1.0 + 2e-6)}, ["angle_deg"]),
        ({"outcome": "gave up", "jumps": 1}, ["outcome", "jumps"]),
    ],
)
def test_what_differs_from_the_record_is_marked(changed, marked):
    assert replace(REACHED, **changed).changes(REACHED) == marked
