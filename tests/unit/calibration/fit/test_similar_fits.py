"""A fit to the sweep of a similar body is the same law, scaled: no length, pressure or moment is its own."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from calibration.fit import fit_and_judge
from calibration.sweep import attributes
from fem_reference import Design
from rodmodel import Domain
from tests.similar_designs import scaled

# Powers of two: both fits differ by the rounding of the laws' numbers alone.
LENGTH, MODULUS = 2.0, 0.25
MOMENT, AREA = MODULUS * LENGTH**3, LENGTH**2
BODY = 0.06
DOMAIN = Domain((70e3, 50e3, 50e3), 100e3, 2e-3)
ITS = Domain(
    tuple(MODULUS * p for p in DOMAIN.pressure_max),
    MODULUS * DOMAIN.pressure_sum_max,
    MOMENT * DOMAIN.moment_max,
)
# Numbers of nine digits in the files of laws, through a chain of iterations.
ALIKE = 1e-6


@pytest.fixture(scope="module")
def similar(dataset):
    steps = np.repeat([LENGTH, 1.0 / MODULUS], 3)
    factors = {
        "pressure": MODULUS,
        "moment": MOMENT,
        "applied_moment": MOMENT,
        "curvature": 1.0 / LENGTH,
        "energy": MODULUS * AREA,
        "volume": AREA,
        "hessian": MODULUS * AREA * np.outer(steps, steps),
    }
    its = dataset.assign({name: dataset[name] * factor for name, factor in factors.items()})
    design = scaled(Design(), LENGTH, MODULUS)
    geometry = {name: getattr(design.geometry, name) for name in attributes(dataset)["geometry"]}
    return its.assign_attrs(geometry=json.dumps(geometry))


@pytest.mark.slow
def test_angles_of_both_laws_are_the_same_at_the_same_share_of_the_pressure(dataset, similar, monkeypatch):
    monkeypatch.setattr("calibration.fit.pipeline.STARTS", 1)
    monkeypatch.setattr("calibration.fit.pipeline.TRIAL_ITERATIONS", 2)
    own = fit_and_judge(dataset, DOMAIN, BODY, 6, 5, 5, 0)
    other = fit_and_judge(similar, ITS, LENGTH * BODY, 6, 5, 5, 0)
    pressure = jnp.asarray(dataset["pressure"].values[::20])
    mine = BODY * jax.vmap(own.law.free_curvature)(pressure)
    theirs = LENGTH * BODY * jax.vmap(other.law.free_curvature)(MODULUS * pressure)
    np.testing.assert_allclose(theirs, mine, rtol=0.0, atol=ALIKE)
    assert np.abs(mine).max() > 0.5
    assert other.domain.pressure_max == pytest.approx([MODULUS * p for p in own.domain.pressure_max])
