"""The shipped rod of ψ = 0, compiled, the same in a smaller domain, and pressures all over both."""

from dataclasses import replace

import numpy as np
import pytest

import rodmodel
from rodmodel import CoreRod
from rodmodel.io import find

NONE = (0.0, 0.0, 0.0)


@pytest.fixture(scope="session")
def rod() -> CoreRod:
    return rodmodel.load_core("double-helix")


@pytest.fixture(scope="session")
def pressures(rod: CoreRod) -> np.ndarray:
    return inside(rod)


@pytest.fixture(scope="session")
def limited() -> CoreRod:
    """Of two chambers the first has 54 kPa if the other has 21; with more, first it is less, then the sum."""
    found = find("double-helix", 0.0, 3e-3)
    less = replace(
        found.domain, pressure_sum_max=82e3, beside_share=4.0 / 7.0, beside_max=66e3, single_max=NONE
    )
    return CoreRod.of(replace(found, domain=less))


@pytest.fixture(scope="session")
def plain() -> CoreRod:
    """Of a chamber alone as much as beside others."""
    found = find("double-helix", 0.0, 3e-3)
    return CoreRod.of(replace(found, domain=replace(found.domain, single_max=NONE)))


@pytest.fixture(scope="session")
def alone() -> CoreRod:
    """Each chamber has at most 50 kPa, but the first alone 66 and the second alone 58."""
    found = find("double-helix", 0.0, 3e-3)
    further = replace(found.domain, pressure_max=(50e3,) * 3, single_max=(66e3, 58e3, 0.0), single_beside=2e3)
    return CoreRod.of(replace(found, domain=further))


def inside(rod: CoreRod) -> np.ndarray:
    """Return 1000 pressures that a rod's domain covers."""
    random = np.random.default_rng(0).uniform(size=(4000, 3)) * np.array(rod.domain.pressure_max)
    return random[rod.domain.covers_pressure(random.T)][:1000]
