"""A law of JAX and the arrays of a calibration file are one another's image."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from rodmodel import LinearLaw, OrientedNetwork
from rodmodel.section import arrays_of, law_from_arrays
from tests.unit.rodmodel import calibrations, synthetic


@pytest.mark.parametrize("oriented", [False, True])
def test_arrays_make_a_law_and_the_law_the_same_arrays(oriented: bool) -> None:
    arrays = calibrations.ridge_arrays(oriented=oriented)
    law = law_from_arrays(arrays)
    assert isinstance(law, OrientedNetwork) is oriented
    back = arrays_of(law)
    for name, value in vars(arrays).items():
        np.testing.assert_array_equal(getattr(back, name), value)


def test_what_a_file_has_no_room_for_is_refused(unchecked: None) -> None:
    law = synthetic.ridge_law(symmetry="full")
    several = replace(law, feature_biases=jnp.zeros((6, 6)))
    with pytest.raises(ValueError, match=r"^section_law.feature_biases: got shape \(6, 6\), expected one"):
        arrays_of(several)
    with pytest.raises(ValueError, match=r"^section_law: got a LinearLaw, expected a RidgeNetwork"):
        arrays_of(LinearLaw(jnp.eye(3), jnp.eye(3)))  # type: ignore[arg-type]
