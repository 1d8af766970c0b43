"""When an iterate is good enough, and how much of a step is taken."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fem_reference.solver import Contact, admissible_part
from fem_reference.solver.convergence import at_noise
from tests.diagonal_problem import Diagonal, Move, Push, double_well, tolerate


def _noisy() -> Diagonal:
    problem = double_well()
    tolerate(problem, contact_noise=5e-3)
    return problem


def _step(farthest: float) -> Any:
    positions = np.zeros((4, 3))
    positions[2, 1] = -farthest
    return SimpleNamespace(positions=positions)


@pytest.mark.parametrize(
    ("force", "farthest", "accepted"),
    [(9e-4, 4e-3, True), (9e-4, 6e-3, False), (2e-3, 1e-6, False)],
)
def test_contact_may_leave_its_noise_in_force_and_step(force, farthest, accepted):
    assert at_noise(_noisy(), _step(farthest), force, 0.0) is accepted


def test_moments_and_other_unknowns_must_be_found_too(monkeypatch):
    problem = _noisy()
    assert not at_noise(problem, _step(1e-6), 1e-6, 1e-3)
    monkeypatch.setattr(problem, "is_small", lambda step: False)
    assert not at_noise(problem, _step(1e-6), 1e-6, 0.0)


class Wall(Contact):
    def keep_walls_apart(self, at, trial):
        return np.minimum(trial, [1e-3, np.inf])


class Walled(Diagonal):
    """Two unknowns, the first with a wall 1 µm ahead of it, which lets half of a step pass or holds it."""

    contact = Wall()

    def allowed(self, linear, trial):
        return 1.0 if trial[0] <= 1e-3 else 0.5


@pytest.mark.parametrize("length", [0.02, 0.0012, 0.001])
def test_walls_in_the_way_are_held_apart_and_the_rest_goes_on(length):
    walled = Walled(lambda x: x, np.ones_like, 2, reach=1.0)
    start = np.zeros(2)
    linear = walled.linearise(start, Push(start))
    at, whole = admissible_part(walled, start, Move(np.full(2, length)), linear, 1.0)
    np.testing.assert_allclose(at, (1e-3, length), rtol=1e-12)
    assert whole is (length <= 1e-3)
