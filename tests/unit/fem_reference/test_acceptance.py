"""When an iterate is good enough, and how much of a step is taken."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fem_reference.acceptance import admissible_part, at_noise
from tests.diagonal_problem import Diagonal, Move, double_well


def _noisy() -> Diagonal:
    problem = double_well()
    problem.noise = 5e-3
    return problem


def _step(farthest: float) -> Any:
    positions = np.zeros((4, 3))
    positions[2, 1] = -farthest
    return SimpleNamespace(positions=positions)


@pytest.mark.parametrize(
    ("force", "farthest", "accepted"),
    [
        # Within the noise in both.
        (9e-4, 4e-3, True),
        (9e-4, 6e-3, False),
        # More force is left only to a node that hardly moves, and not any.
        (9e-3, 4e-3, False),
        (9e-3, 9e-5, True),
        (9e-3, 2e-4, False),
        (3e-2, 1e-6, False),
    ],
)
def test_a_node_between_close_walls_may_keep_more_force(force, farthest, accepted):
    assert at_noise(_noisy(), _step(farthest), force, 0.0) is accepted


def test_moments_and_other_unknowns_must_be_found_too(monkeypatch):
    problem = _noisy()
    assert not at_noise(problem, _step(1e-6), 1e-6, 1e-3)
    monkeypatch.setattr(problem, "is_small", lambda step: False)
    assert not at_noise(problem, _step(1e-6), 1e-6, 0.0)


class Walled(Diagonal):
    """Two unknowns, the first with a wall 1 µm ahead of it, which lets half of a step pass or holds it."""

    nearby = 0.05

    def allowed(self, linear, trial):
        return 1.0 if trial[0] <= 1e-3 else 0.5

    def held_apart(self, at, trial):
        return np.minimum(trial, [1e-3, np.inf])


@pytest.mark.parametrize(
    ("length", "expected"),
    [
        (0.02, (1e-3, 0.02)),  # what is in the way is held, and the rest goes on
        (0.0012, (1e-3, 0.0012)),
        (0.001, (1e-3, 0.001)),  # nothing is in the way
    ],
)
def test_long_steps_have_walls_held_apart_and_short_ones_are_cut(length, expected):
    """A thousandth of a millimetre, in the root mean square of all unknowns, is short."""
    walled = Walled(lambda x: x, np.ones_like, 2, reach=1.0)
    step = Move(np.full(2, length))
    at, whole = admissible_part(walled, np.zeros(2), step, None, 1.0)
    np.testing.assert_allclose(at, expected, rtol=1e-12)
    assert whole is (length <= 1e-3)
    # For one alone of the two that is less than a micrometre in the mean.
    step = Move(np.array([1.2e-3, 0.0]))
    at, whole = admissible_part(walled, np.zeros(2), step, None, 1.0)
    np.testing.assert_allclose(at, [0.6e-3, 0.0], rtol=1e-12)
    assert not whole
