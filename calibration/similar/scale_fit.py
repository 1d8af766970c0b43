"""The law of a similar actuator with its scales fitted: of pressure, curvature, energy and volume.

Actuators that differ a little, in a wall or in the silicone's hardening, differ in first order by how much
pressure they want, how far they bend and how stiff they are. Four numbers say so, which a few states tell;
a network's thousand parameters want hundreds.
"""

from dataclasses import replace
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from calibration.fit import Metric, Samples, residuals
from rodmodel import RidgeNetwork

_SCALES = ("pressure_scale", "curvature_scale", "energy_scale", "rest_volume")
# Difference of a logarithm for slopes, and the unit of the search.
_STEP, _UNIT = 1e-4, 0.1
# Largest change of a logarithm: a law that is off by more is not similar.
_MOST = 1.5


def rescaled(law: RidgeNetwork, samples: Samples, scales: Metric) -> RidgeNetwork:
    """Return a law with the scales that fit the states best, by least squares.

    Parameters
    ----------
    law : law of a similar actuator.
    samples, scales : training states and their metric, as of `calibration.fit.fit`.
    """

    def scaled(logarithms: Float[np.ndarray, "4"], number: Any) -> RidgeNetwork:
        factors = np.exp(logarithms)
        values = {
            name: number(getattr(law, name) * factor) for name, factor in zip(_SCALES, factors, strict=True)
        }
        return replace(law, **values)

    # As arrays the scales are inputs of what is compiled; the law keeps plain numbers.
    found = least_squares(
        lambda x: residuals(scaled(x, jnp.asarray), samples, scales).ravel(),
        np.zeros(len(_SCALES)),
        x_scale=_UNIT,
        diff_step=_STEP,
        bounds=(-_MOST, _MOST),
    )
    return scaled(found.x, float)
