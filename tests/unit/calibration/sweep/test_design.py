"""Loading paths: inside the domain, in small steps, reproducible, judges kept apart."""

import numpy as np
import pytest

from calibration.sweep import design_paths, inside
from calibration.sweep.design import MOMENT_STEPS, edge, paths_around
from rodmodel import Domain

DOMAIN = Domain((70e3, 50e3, 50e3), 100e3, 2e-3, 1e-3)
STEP = 3e3


def loads_of(path):
    pressure = np.array([load.pressure for load in path.loads])
    return pressure, np.array([load.moment for load in path.loads])


@pytest.fixture(scope="module")
def paths():
    return design_paths(DOMAIN, 120, seed=3, pressure_step=STEP)


def test_every_load_is_inside_the_domain(paths):
    for path in paths:
        assert inside(DOMAIN, *loads_of(path)).all(), path.name


def test_steps_are_no_larger_than_asked_and_begin_at_rest(paths):
    for path in paths:
        pressure, moment = (np.vstack([np.zeros(3), values]) for values in loads_of(path))
        assert np.abs(np.diff(pressure, axis=0)).max() <= STEP * (1 + 1e-9), path.name
        steps = np.linalg.norm(np.diff(moment, axis=0) / DOMAIN.moment_axes, axis=1)
        assert steps.max() <= 1.0 / MOMENT_STEPS * (1 + 1e-9), path.name


def test_a_seed_always_gives_the_same_paths_and_a_longer_design_begins_with_the_shorter_one(paths):
    assert design_paths(DOMAIN, 12, seed=3, pressure_step=STEP) == paths[:12]
    assert design_paths(DOMAIN, 12, seed=4, pressure_step=STEP) != paths[:12]


def test_a_fifth_is_held_out_with_pressure_in_all_chambers_half_of_it_with_moment(paths):
    held_out = [path for path in paths if path.role == "held-out"]
    assert len(held_out) == len(paths) // 5
    loaded = 0
    for path in held_out:
        pressure, moment = loads_of(path)
        assert (pressure > 0).any(axis=0).all(), path.name
        loaded += bool(np.any(moment))
    assert loaded == len(held_out) // 2


def test_training_reaches_the_edge_in_each_named_direction(paths):
    ends = [loads_of(path)[0][-1] for path in paths if path.name.endswith("train-named")]
    for direction in ((1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 1, 1), (1, 1, 1)):
        limit = edge(DOMAIN, np.array(direction, dtype=float))
        assert min(np.linalg.norm(end - limit) for end in ends) < 1e-6, direction


def test_steps_are_half_as_long_in_the_named_directions(paths):
    named = [path for path in paths if path.name.endswith("named")]
    assert len(named) == 5
    for path in named:
        pressure, _ = loads_of(path)
        assert np.abs(np.diff(pressure, axis=0)).max() <= 0.5 * STEP * (1 + 1e-9), path.name


def test_directions_of_pressure_are_spread_over_all_shares(paths):
    """Of the triangle of shares, cut into 36 alike, none is left without a path of its own."""
    ends = np.array([loads_of(path)[0][-1] for path in paths if path.role == "train"])
    shares = ends[ends.sum(axis=1) > 0]
    shares = 6.0 * shares / shares.sum(axis=1, keepdims=True) * (1.0 - 1e-9)
    cells = {tuple(cell) for cell in np.floor(shares).astype(int).tolist() if sum(cell) >= 4}
    assert len(cells) == 36


def test_chamber_3_alone_is_run_only_where_it_is_no_mirror_image_of_chamber_2():
    def alone(paths):
        return [path for path in paths if np.all(loads_of(path)[0][:, :2] == 0) and np.any(loads_of(path)[0])]

    assert not alone(design_paths(DOMAIN, 30, seed=0, pressure_step=STEP, mirror=True))
    assert alone(design_paths(DOMAIN, 30, seed=0, pressure_step=STEP, mirror=False))


@pytest.mark.parametrize(
    ("direction", "limit"),
    [
        ((1, 0, 0), (70e3, 0, 0)),
        ((0, 1, 1), (0, 50e3, 50e3)),
        ((1, 1, 1), (100e3 / 3,) * 3),
        ((2, 1, 0), (200e3 / 3, 100e3 / 3, 0)),
    ],
)
def test_the_edge_is_where_the_first_limit_is_met(direction, limit):
    assert edge(DOMAIN, np.array(direction, dtype=float)) == pytest.approx(limit, rel=1e-12)


@pytest.mark.parametrize(("number", "step", "named"), [(0, STEP, "number"), (5, 0.0, "pressure_step")])
def test_impossible_designs_are_refused(number, step, named):
    with pytest.raises(ValueError, match=named):
        design_paths(DOMAIN, number, seed=0, pressure_step=step)


def test_paths_on_windings_of_their_own_spread_evenly_over_the_orientations():
    low, high = 0.0, np.pi / 6.0
    paths = design_paths(DOMAIN, 120, seed=3, pressure_step=STEP, mirror=False, orientations=(low, high))
    for role in ("train", "held-out"):
        psi = np.sort([path.psi for path in paths if path.role == role])
        assert low <= psi[0] < psi[-1] <= high
        # The largest gap of n uniform random places is about ln(n)/n of the range.
        assert np.diff([low, *psi, high]).max() < 3.0 * np.log(len(psi)) / len(psi) * (high - low)
    # Ends of the range are planes of symmetry, and are trained on.
    assert {low, high} <= {path.psi for path in paths}
    singles = [p for p in paths if p.role == "train" and np.count_nonzero(p.loads[-1].pressure) == 1]
    # Of each of two rounds, and of paths whose shares fall to one chamber.
    assert len({path.psi for path in singles}) >= 6
    assert all(path.psi is None for path in design_paths(DOMAIN, 12, seed=3, pressure_step=STEP))


def test_paths_around_a_chamber_end_near_its_largest_pressure_with_little_in_the_others():
    domain = Domain((16e3, 72e3, 16e3), 100e3, 3e-3, 1.5e-3)
    paths = paths_around(domain, 2, 30, seed=0, pressure_step=8e3)
    assert [path.role for path in paths] == (["train"] * 4 + ["held-out"]) * 6
    ends = np.array([path.loads[-1].pressure for path in paths])
    np.testing.assert_allclose(ends[0], [0.0, 72e3, 0.0])
    assert ends[:, 1].min() > 0.79 * 72e3
    assert ends[:, [0, 2]].max() > 12e3
    for path in paths:
        pressure, moment = (np.array([getattr(x, key) for x in path.loads]) for key in ("pressure", "moment"))
        assert inside(domain, pressure, moment).all()
        assert np.abs(np.diff(pressure, axis=0, prepend=0.0)).max() <= 8e3 * (1.0 + 1e-9)
        assert moment.any() == ("mixed" in path.name)
    assert paths_around(domain, 2, 7, seed=0, pressure_step=8e3) == paths[:7]
