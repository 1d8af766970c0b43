"""Budgets of time, and the meshes that they allow."""

import math
from pathlib import Path

import pytest

from calibration.from_design import Budget, Meshes, Task
from fem_reference import LEVELS, Design, Ring


@pytest.mark.parametrize(
    ("text", "seconds"), [("20min", 1200.0), ("1h", 3600.0), ("1.5h", 5400.0), ("90s", 90.0)]
)
def test_a_budget_is_a_time(text, seconds):
    assert Budget.parse(text).seconds == seconds


@pytest.mark.parametrize("text", ["", "1", "h", "-1h", "1d", "nanmin", "5s", "1 h"])
def test_another_text_is_refused_with_what_is_expected(text):
    with pytest.raises(ValueError, match=r"budget: got .*, expected"):
        Budget.parse(text)


def test_an_hour_has_the_converged_mesh_and_less_the_coarse_one():
    """And each has a finer one to compare with. In an hour the coarse one will do, if it is close."""
    short, hour, day = (Meshes.of(Budget.parse(text), Design()) for text in ("20min", "1h", "8h"))
    assert (short.sweep, short.finer) == ("coarse", "fine")
    assert (hour.sweep, hour.finer) == ("fine", "finer")
    assert (short.cheaper, hour.cheaper, day.cheaper) == (None, "coarse", None)
    assert (hour.actuator, day.actuator) == ("coarse", "layered")


def test_rings_have_a_mesh_beyond_their_converged_one():
    ring = Meshes.of(Budget.parse("1h"), Design(winding=Ring()))
    assert ring.sweep == "finer"
    assert ring.finer.axial_size < LEVELS["finer"].axial_size


def test_a_task_has_the_meshes_of_its_budget():
    task = Task(Design(), Budget.parse("1h"), Path("run"), "the command")
    assert task.levels == Meshes.of(task.budget, task.design)
    assert task.angle == math.pi
