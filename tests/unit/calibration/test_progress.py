"""Progress over several stages: the time that is left."""

import pytest

from calibration.progress import Stages, progress_bar, stages_bar


class Clock:
    """A clock that is set."""

    now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


def test_at_the_start_all_stages_are_left(clock):
    assert Stages({"range": 10.0, "sweep": 100.0, "fit": 20.0}, clock).left == pytest.approx(130.0)


def test_a_stage_tells_its_own_pace(clock):
    """A quarter of it took 50 s, so that 150 s are left of it, whatever was expected."""
    stages = Stages({"range": 10.0, "sweep": 100.0, "fit": 20.0}, clock)
    stages.begin("sweep")
    clock.now = 50.0
    stages.reach(0.25)
    assert stages.left == pytest.approx(150.0 + 20.0)
    assert stages.title == "2/3 sweep"


def test_a_stage_that_takes_longer_has_no_time_left_rather_than_less(clock):
    stages = Stages({"range": 10.0, "fit": 20.0}, clock)
    clock.now = 60.0
    assert stages.left == pytest.approx(20.0)


def test_a_corrected_expectation_counts(clock):
    stages = Stages({"range": 10.0, "sweep": 100.0}, clock)
    stages.expect("sweep", 500.0)
    assert stages.left == pytest.approx(510.0)


def test_bars_of_a_stage_move_it_and_nothing_is_shown_off_a_terminal(capsys):
    with stages_bar({"range": 10.0, "sweep": 100.0}) as stages:
        stages.begin("sweep")
        with progress_bar(4, "states") as advance:
            advance(1, "path 1")
            advance(2, "path 2")
            assert stages._share == pytest.approx(0.75)
    with progress_bar(4, "states") as advance:
        advance(1, "path 1")
    assert stages._share == pytest.approx(0.75)
    printed = capsys.readouterr()
    assert printed.out == printed.err.strip() == ""
