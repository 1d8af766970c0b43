"""Scales of a similar law, from a few states."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from calibration.fit import equilibrium, free_curvatures, mean_square, states_of
from calibration.fit.pipeline import metric_in
from calibration.similar import rescaled
from rodmodel import Domain, RidgeNetwork
from rodmodel.io import find

LENGTH = 0.06
DOMAIN = Domain((40e3, 40e3, 40e3), 80e3, 2e-3)
FACTORS = {"pressure_scale": 0.8, "curvature_scale": 1.2, "energy_scale": 1.1, "rest_volume": 0.9}


def times(law: RidgeNetwork, factors: dict[str, float]) -> RidgeNetwork:
    return replace(law, **{name: factor * float(getattr(law, name)) for name, factor in factors.items()})


def test_planted_scales_are_found_from_ten_states() -> None:
    """To the tolerance of the search; all else of the law stays what it was."""
    law = find("double-helix", 0.0, 3e-3).calibration.section_law
    assert isinstance(law, RidgeNetwork)
    planted = times(law, FACTORS)
    rng = np.random.default_rng(0)
    pressure = rng.uniform(0.0, 25e3, (10, 3))
    psi = np.zeros(10)
    loads = jnp.asarray(pressure), jnp.asarray(rng.uniform(-5e-4, 5e-4, (10, 3)))
    start = free_curvatures(planted, loads[0], jnp.asarray(psi))
    curvature, good = map(np.asarray, equilibrium(planted, *loads, start, jnp.asarray(psi)))
    assert good.all()
    states = states_of([planted], pressure, curvature, psi, "planted")
    scales = metric_in(DOMAIN, states, LENGTH)
    found = rescaled(law, states, scales)
    for name in FACTORS:
        assert isinstance(getattr(found, name), float)
        assert getattr(found, name) == pytest.approx(getattr(planted, name), rel=1e-6)
    assert mean_square(found, states, scales) < 1e-9 * mean_square(law, states, scales)
    np.testing.assert_array_equal(found.weights, law.weights)
