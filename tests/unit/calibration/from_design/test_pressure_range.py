"""The range of pressures, on a cell in closed form: each reason to end, and the domain that it leaves."""

from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

from calibration.from_design import Budget, Meshes, StageError, Task
from calibration.from_design import pressure_range as stage
from calibration.from_design.pressure_range import PathEnd, domain_of, path_end, range_paths
from calibration.sweep import inside
from fem_reference import CellError, Design, DoubleHelix, Ring
from tests.fem_fixtures import TINY
from tests.unit.calibration.manufactured_cell import ManufacturedTracer, free_curvature

OPEN = Design()
LENGTH = OPEN.geometry.body_length
# The step of a path in this body [Pa]: 4 kPa.
STEP = 4e3


def never(state):
    return None


def end_of(chambers=(1,), design=OPEN, wanted=10.0, beyond=never, **failures) -> PathEnd:
    return path_end(ManufacturedTracer(**failures)(), chambers, design, wanted, beyond)


def angle(pressure: float, chambers) -> float:
    pressures = jnp.array([pressure if k in chambers else 0.0 for k in (1, 2, 3)])
    return LENGTH * float(jnp.linalg.norm(free_curvature(pressures)[:2]))


@pytest.mark.parametrize("chambers", [(1,), (2,), (1, 2), (2, 3)])
def test_a_path_ends_at_the_wanted_angle(chambers):
    """Linear between two states 4 kPa apart, whose curve bends by less than 1 % of the step's rise."""
    found = end_of(chambers, wanted=0.9)
    exact = brentq(lambda p: angle(p, chambers) - 0.9, 1e3, 100e3)
    assert found.reason == stage.ANGLE
    assert found.pressure == pytest.approx(exact, abs=0.05 * STEP)
    assert found.angle == pytest.approx(0.9)


def test_a_path_ends_where_walls_lose_their_balance():
    """To a quarter of a step, after two bisections, and never beyond."""
    found = end_of(snaps_beyond=33.5e3)
    assert found.reason == stage.STABILITY
    assert 33.5e3 - STEP / 4 <= found.pressure <= 33.5e3
    assert found.angle == pytest.approx(angle(found.pressure, (1,)), rel=1e-6)


def test_a_path_ends_where_a_step_leads_to_another_branch():
    """To states that are stable, and that the continuation did not say it had jumped to."""
    found = end_of(silent_snap_beyond=33.5e3)
    assert (found.reason, found.detail) == (stage.STABILITY, "the walls snap")
    assert 33.5e3 - STEP / 4 <= found.pressure <= 33.5e3


def test_a_path_ends_where_a_state_is_not_stable():
    found = end_of((1, 2), saddle_beyond=50e3)
    assert found.reason == stage.STABILITY
    assert 25e3 - STEP / 4 <= found.pressure <= 25e3


def test_a_path_ends_where_the_silicone_leaves_its_tests():
    told = "a stretch of 3 in the silicone, which was tested up to 2"
    found = end_of(beyond=lambda state: told if max(state.load.pressure) > 21.1e3 else None)
    assert (found.reason, found.detail) == (stage.STRETCH, told)
    assert 21.1e3 - STEP / 4 <= found.pressure <= 21.1e3


def test_a_path_ends_where_the_solver_does():
    found = end_of(fails_beyond=30e3)
    assert found.reason == stage.SOLVER
    assert "no step to" in found.detail


def test_a_cell_that_gives_way_at_once_is_an_error():
    with pytest.raises(StageError, match=r"range: chambers 1 and 2: .* below 4 kPa"):
        end_of((1, 2), snaps_beyond=1e3)


def test_the_pressures_of_a_design_are_kept():
    """Whatever the angle; and a path that ends below tells it."""
    design = replace(OPEN, pressure_max=(30e3, 20e3, 20e3), pressure_sum_max=36e3)
    assert end_of((1,), design, wanted=0.1).pressure == pytest.approx(30e3)
    assert end_of((1, 2), design, wanted=0.1).pressure == pytest.approx(18e3)
    assert end_of((1,), design, wanted=0.1).reason == stage.GIVEN
    assert end_of((1,), design, snaps_beyond=15e3).reason == stage.STABILITY
    domain = domain_of(design, [])
    assert (domain.pressure_max, domain.pressure_sum_max) == (design.pressure_max, 36e3)


def ends(first=60e3, second=55e3, pair=40e3):
    rows = [((1,), first), ((2,), second), ((1, 2), pair), ((2, 3), 1.1 * pair)]
    return [PathEnd(chambers, p, 1.0, stage.ANGLE, "", (p,), (1.0,), 0.5) for chambers, p in rows]


@pytest.mark.parametrize(("pair", "beside"), [(40e3, True), (20e3, True), (60e3, False), (80e3, False)])
def test_the_corners_of_a_domain_are_the_ends_of_the_paths(pair, beside):
    """One chamber and two alike reach their ends in it, and 1 % more leaves it."""
    domain = domain_of(OPEN, ends(pair=pair))
    assert np.isfinite(domain.beside_max) == beside
    most = min(60e3, 2.0 * pair)
    # Of pairs far above one chamber, each chamber has its own limit.
    each = min(pair, 55e3)
    corners = np.array(
        [[most, 0.0, 0.0], [0.0, 0.0, min(55e3, 2.0 * pair)], [each, each, 0.0], [0.0, each, each]]
    )
    none = np.zeros((4, 3))
    assert inside(domain, corners, none).all()
    assert not inside(domain, 1.01 * corners, none).any()


def test_limits_have_three_digits_and_lose_less_than_a_percent_of_the_pairs():
    domain = domain_of(OPEN, ends(first=25.9e3, second=25.1e3, pair=24.7e3))
    assert domain.beside_max == 25.9e3
    assert 0.99 * 24.7e3 < domain.beside_max / (1.0 + domain.beside_share) <= 24.7e3
    assert "25.9 kPa in each" in domain.largest_pressures("kPa")


def test_a_domain_of_another_body_is_scaled_in_its_moments():
    """A section's moments go as modulus times length³."""
    half = replace(
        OPEN,
        geometry=replace(
            OPEN.geometry,
            **{
                name: 0.5 * getattr(OPEN.geometry, name)
                for name in (
                    "body_diameter",
                    "cavity_diameter",
                    "outer_wall",
                    "inner_wall",
                    "partition_wall",
                    "body_length",
                    "cap_length",
                    "winding_diameter",
                )
            },
        ),
        winding=DoubleHelix(pitch=1.5e-3),
        thread=replace(OPEN.thread, radius=0.5 * OPEN.thread.radius),
    )
    one, other = (domain_of(design, ends()) for design in (OPEN, half))
    assert other.moment_max == pytest.approx(one.moment_max / 8.0)
    assert other.torque_max == pytest.approx(one.torque_max / 8.0)


@pytest.mark.parametrize("pressure", [59999.0, 60e3, 1234.5, 7.777e3])
def test_pressures_are_rounded_down_to_three_digits(pressure):
    found = stage.rounded_down(pressure)
    assert 0.99 * pressure < found <= pressure
    assert float(f"{found:.3g}") == found


def test_paths_that_are_alike_are_followed_once():
    assert range_paths(Design(winding=Ring())) == ((1,), (2, 3))
    assert len(range_paths(Design())) == 4
    assert len(range_paths(Design(winding=DoubleHelix(psi=0.4)))) == 6


def coarse_task(directory: Path, workers: int) -> Task:
    meshes = Meshes(*["coarse"] * 4)
    return Task(OPEN, Budget(600.0), directory, "the command", angle=0.9, workers=workers, meshes=meshes)


def test_several_workers_follow_the_paths_that_one_does(tmp_path: Path, monkeypatch):
    """Each path is a job; one that fails there fails here again, with its reason."""
    asked = []

    def run_jobs(jobs, workers, watch):
        asked.extend(job.name for job in jobs)
        for job in jobs:
            job.target(*job.args)

    def follow(cell, loads, start=None, jumps=False):
        return ManufacturedTracer()()(loads, start)

    monkeypatch.setattr(stage, "run_jobs", run_jobs)
    monkeypatch.setattr(stage, "follow", follow)
    monkeypatch.setattr(stage.PeriodCell, "of", lambda *_: "the cell")
    monkeypatch.setattr(stage, "stretch_beyond_tests", lambda cell, state: None)
    one, two = (stage.find_range(coarse_task(tmp_path / str(n), n)) for n in (1, 2))
    assert len(asked) == 4
    timeless = [replace(end, seconds=0.0) for end in (*one, *two)]
    assert timeless[:4] == timeless[4:]
    monkeypatch.setattr(stage, "stretch_beyond_tests", lambda cell, state: "left the tests")
    with pytest.raises(StageError, match="range: chamber 1: left the tests below"):
        stage.find_range(coarse_task(tmp_path / "torn", 2))


@pytest.mark.slow
def test_paths_are_followed_in_processes(tmp_path: Path):
    """On the fewest elements, to an angle of some degrees."""
    task = replace(coarse_task(tmp_path, 2), angle=0.1, meshes=Meshes(*[TINY] * 4))
    ends = stage.find_range(task)
    assert [end.reason for end in ends] == [stage.ANGLE] * 4
    assert {file.name for file in tmp_path.iterdir()} == {f"range-{k}.json" for k in ("1", "2", "12", "23")}


def test_a_path_on_file_is_not_followed_again(tmp_path: Path, monkeypatch):
    """After an interrupt the next call begins with the path that was cut."""
    task = coarse_task(tmp_path, workers=1)
    followed = []

    def follow(cell, loads, start=None, jumps=False):
        followed.append(cell)
        if len(followed) == 3:
            raise KeyboardInterrupt
        return ManufacturedTracer()()(loads, start)

    monkeypatch.setattr(stage, "follow", follow)
    monkeypatch.setattr(stage.PeriodCell, "of", lambda *_: "the cell")
    monkeypatch.setattr(stage, "stretch_beyond_tests", lambda cell, state: None)
    with pytest.raises(KeyboardInterrupt):
        stage.find_range(task)
    assert len(stage.find_range(task)) == 4
    assert len(followed) == 5
    assert stage.find_range(task) == stage.find_range(task)
    assert len(followed) == 5
    stage.find_range(replace(task, angle=0.8))
    assert len(followed) == 9


def test_an_error_of_the_cell_is_told():
    def broken(loads, start):
        yield from ManufacturedTracer()()([next(iter(loads))], start)
        raise CellError("the matrix is singular", last_good=None)

    found = path_end(broken, (1,), OPEN, 10.0, never)
    assert found.detail == "the matrix is singular"
