"""Gradient and Hessian of a network, written out, are those of its potential."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from calibration.fit import Scales, initial_law, initial_oriented
from calibration.fit.potential_derivatives import UPPER, gradient_and_hessian
from rodmodel import Domain, load, load_oriented

DOMAIN = Domain((70e3, 50e3, 50e3), 100e3, 2e-3)
SCALES = Scales.of(DOMAIN, 0.06, 15.5e-6)
# Of sums of some hundred terms, each rounded: relative to the largest entry of gradient or Hessian, in scaled
# variables.
ROUNDING = 1e-12


def stirred(law, seed=1):
    """The law with all its parameters moved, so that none is zero."""
    parameters, unravel = ravel_pytree(law)
    return unravel(parameters + 0.2 * np.random.default_rng(seed).standard_normal(parameters.size))


def laws():
    for symmetry in ("none", "mirror", "full"):
        yield symmetry, stirred(initial_law(SCALES, ridges=5, features=4, seed=0, symmetry=symmetry))
    yield "at an orientation", stirred(initial_oriented(SCALES, ridges=5, features=4, seed=0)).at_psi(0.3)
    yield "shipped", load("double-helix").section
    yield "shipped, of all orientations", load_oriented("double-helix").section.at_psi(0.7)


@pytest.mark.parametrize(("name", "law"), [pytest.param(*pair, id=pair[0]) for pair in laws()])
def test_they_are_the_derivatives_of_the_potential(name, law):
    unit = np.array([SCALES.curvature] * 3 + [SCALES.pressure] * 3)

    def potential(y):
        return law.potential(y[:3], y[3:])

    written_out = jax.jit(partial(gradient_and_hessian, law))
    derived = jax.jit(lambda y: (jax.grad(potential)(y), jax.hessian(potential)(y)))
    for y in unit * np.random.default_rng(3).standard_normal((4, 6)):
        found = written_out(jnp.asarray(y))
        slope, curved = derived(y)
        gradient, hessian = unit * slope, np.outer(unit, unit) * curved
        for part, scale, expected in (
            (found[:6], unit, gradient),
            (found[6:], np.outer(unit, unit)[UPPER], hessian[UPPER]),
        ):
            assert np.abs(part * scale - expected).max() <= ROUNDING * np.abs(expected).max()
