"""The shipped rod of ψ = 0, compiled, and pressures all over its domain."""

import numpy as np
import pytest

import rodmodel
from rodmodel import CoreRod


@pytest.fixture(scope="session")
def rod() -> CoreRod:
    return rodmodel.load_core("double-helix")


@pytest.fixture(scope="session")
def pressures(rod: CoreRod) -> np.ndarray:
    random = np.random.default_rng(0).uniform(size=(4000, 3)) * np.array(rod.domain.pressure_max)
    return random[random.sum(axis=1) <= rod.domain.pressure_sum_max][:1000]
