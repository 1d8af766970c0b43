"""A law with its images written out is the same potential; less symmetry cannot be made more."""

import itertools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from calibration.start import Scales, initial_law
from calibration.unfold import of_all_orientations, unfolded
from rodmodel import Domain

SCALES = Scales.of(Domain((55e3, 53e3, 53e3), 100e3, 6.6e-3), 0.06, 15.5e-6)
ROUNDING = 1e-12  # a sum of fifty terms about as large as the potential's scale


def law_of(symmetry):
    """With a tension that no symmetry has by itself, and slopes of all hidden functions."""
    law = initial_law(SCALES, ridges=5, features=4, seed=3, symmetry=symmetry)
    return replace(law, factor=jnp.arange(1.0, 7.0), slopes=jnp.linspace(-1.0, 1.0, 7))


@pytest.mark.parametrize(
    ("symmetry", "less"),
    [("full", "full"), ("full", "mirror"), ("full", "none"), ("mirror", "none"), ("none", "none")],
)
def test_the_potential_is_the_same_with_its_images_written_out(symmetry, less):
    law = law_of(symmetry)
    other = unfolded(law, less)
    assert other.symmetry == less
    assert len(other.offsets) * len(other.images) == len(law.offsets) * len(law.images)
    rng = np.random.default_rng(0)
    for _ in range(5):
        curvature, pressure = jnp.asarray(30.0 * rng.standard_normal(3)), jnp.asarray(5e4 * rng.random(3))
        for derivative in (lambda f: f, lambda f: jax.grad(f, 0), lambda f: jax.grad(f, 1)):
            expected = np.asarray(derivative(law.potential)(curvature, pressure))
            found = np.asarray(derivative(other.potential)(curvature, pressure))
            np.testing.assert_allclose(found, expected, rtol=ROUNDING, atol=ROUNDING * np.abs(expected).max())


@pytest.mark.parametrize(("symmetry", "more"), [("none", "mirror"), ("none", "full"), ("mirror", "full")])
def test_symmetry_that_a_law_has_not_is_refused(symmetry, more):
    with pytest.raises(
        ValueError, match=f"symmetry: got '{more}', expected a part of the law's own, '{symmetry}'"
    ):
        unfolded(law_of(symmetry), more)


def test_as_one_of_all_orientations_a_law_is_the_same_at_each():
    law = law_of("full")
    curvature, pressure = jnp.array([3.0, -20.0, 1.0]), jnp.array([3e4, 1e4, 2e4])
    energies = [
        float(of_all_orientations(law).at_psi(psi).potential(curvature, pressure)) for psi in (0.0, 0.3, 2.0)
    ]
    for one, other in itertools.pairwise([float(law.potential(curvature, pressure)), *energies]):
        assert one == pytest.approx(other, rel=ROUNDING)
