"""Conversion of ridge networks from and to the plain arrays of a calibration file."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from rodmodel.io import RidgeArrays
from rodmodel.section._oriented_network import OrientedNetwork
from rodmodel.section._ridge_network import RidgeNetwork

_ARRAYS = (
    "feature_weights",
    "feature_biases",
    "directions",
    "mixing",
    "offsets",
    "weights",
    "factor",
    "slopes",
    "guess",
)
_ADJUSTED = ("rest_pressures", "quadratic")
_SCALES = ("pressure_scale", "curvature_scale", "energy_scale", "rest_volume")


def law_from_arrays(arrays: RidgeArrays) -> RidgeNetwork | OrientedNetwork:
    """Return the law of a calibration, in arrays of JAX's default precision.

    Parameters
    ----------
    arrays : law as plain arrays.

    Returns
    -------
    law : law of one orientation, or of all if the arrays include orientation weights.
    """
    leaves = {name: jnp.asarray(getattr(arrays, name), float) for name in _ARRAYS}
    scales = {name: getattr(arrays, name) for name in _SCALES}
    adjusted = {name: getattr(arrays, name) for name in _ADJUSTED}
    leaves |= {name: jnp.asarray(value, float) for name, value in adjusted.items() if value is not None}
    network = RidgeNetwork(**leaves, **scales, symmetry=arrays.symmetry)
    if arrays.orientation_weights is None:
        return network
    return OrientedNetwork(network, jnp.asarray(arrays.orientation_weights, float))


def arrays_of(law: RidgeNetwork | OrientedNetwork) -> RidgeArrays:
    """Return a law as plain arrays, as calibration files hold it.

    Parameters
    ----------
    law : law of all orientations, or of one whose images share their biases w.

    Raises
    ------
    ValueError
        For a law of another kind, or a number that a file cannot hold.
    """
    network = law.network if isinstance(law, OrientedNetwork) else law
    if not isinstance(network, RidgeNetwork):
        raise ValueError(
            f"section_law: got a {type(network).__name__}, expected a RidgeNetwork or an OrientedNetwork"
        )
    if network.feature_biases.ndim != 1:
        raise ValueError(
            f"section_law.feature_biases: got shape {network.feature_biases.shape}, expected one bias per "
            "feature; save the law of all orientations that this one came from"
        )
    parts: dict[str, Any] = {name: np.asarray(getattr(network, name)) for name in _ARRAYS}
    parts |= {name: float(getattr(network, name)) for name in _SCALES}
    adjusted = {name: getattr(network, name) for name in _ADJUSTED}
    parts |= {name: np.asarray(value) for name, value in adjusted.items() if value is not None}
    return RidgeArrays(
        **parts,
        symmetry=network.symmetry,
        orientation_weights=np.asarray(law.orientation_weights) if isinstance(law, OrientedNetwork) else None,
    )
