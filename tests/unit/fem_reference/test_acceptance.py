"""When an iterate is good enough."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fem_reference.acceptance import at_noise
from tests.diagonal_problem import Diagonal, double_well


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
