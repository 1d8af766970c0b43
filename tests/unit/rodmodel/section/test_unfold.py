"""A law with its images written out is the same potential; less symmetry cannot be made more."""

from dataclasses import replace
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rodmodel import RidgeNetwork, unfolded

SCALES = {"pressure_scale": 22e3, "curvature_scale": 50.0, "energy_scale": 0.3, "rest_volume": 15.5e-6}
ROUNDING = 1e-12  # a sum of fifty terms about as large as the potential's scale


def law_of(symmetry):
    rng = np.random.default_rng(3)
    shapes = {"feature_weights": (4, 3), "feature_biases": (4,), "directions": (5, 3), "mixing": (5, 7)}
    shapes |= {"offsets": (5,), "weights": (5,), "slopes": (7,), "guess": (3, 7)}
    arrays = {name: jnp.asarray(rng.standard_normal(shape)) for name, shape in shapes.items()}
    # The factor is of a stiffness without any symmetry.
    return RidgeNetwork(**arrays, factor=jnp.arange(1.0, 7.0), **SCALES, symmetry=symmetry)


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
    states = jnp.asarray(30.0 * rng.standard_normal((5, 3))), jnp.asarray(5e4 * rng.random((5, 3)))
    for expected, found in zip(slopes(law, *states), slopes(other, *states), strict=True):
        np.testing.assert_allclose(found, expected, rtol=ROUNDING, atol=ROUNDING * np.abs(expected).max())


@eqx.filter_jit
@partial(eqx.filter_vmap, in_axes=(None, 0, 0))
def slopes(law, curvature, pressure):
    """Potential, and its gradient in (u, p)."""
    value, gradient = jax.value_and_grad(law.potential, (0, 1))(curvature, pressure)
    return value, *gradient


@pytest.mark.parametrize(
    ("symmetry", "more"), [("none", "mirror"), ("none", "full"), ("mirror", "full"), ("full", "knot")]
)
def test_symmetry_that_a_law_has_not_is_refused(symmetry, more):
    with pytest.raises(
        ValueError, match=f"symmetry: got '{more}', expected a part of the law's own, '{symmetry}'"
    ):
        unfolded(law_of(symmetry), more)


def test_images_that_have_a_bias_each_are_all_written_out():
    law = replace(law_of("full"), feature_biases=jnp.linspace(-1.0, 1.0, 24).reshape(6, 4))
    curvature, pressure = jnp.array([3.0, -20.0, 1.0]), jnp.array([3e4, 1e4, 2e4])
    expected = float(law.potential(curvature, pressure))
    assert float(unfolded(law).potential(curvature, pressure)) == pytest.approx(expected, rel=ROUNDING)
    with pytest.raises(ValueError, match="expected 'none'"):
        unfolded(law, "mirror")
