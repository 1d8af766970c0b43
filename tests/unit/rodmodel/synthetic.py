"""Section laws and rods of known behaviour, for tests: none of them calibrates anything."""

import jax.numpy as jnp
import numpy as np

import rodmodel
from rodmodel import LinearLaw, RidgeNetwork
from rodmodel.section import law_from_arrays
from tests.unit.rodmodel import calibrations
from tests.unit.rodmodel.calibrations import (
    ACTUATOR,
    BENDING_STIFFNESS,
    CURVATURE_SCALE,
    DOMAIN,
    FULL_PRESSURE,
    TORSION_RATIO,
)

REST_VOLUME = 15.5e-6  # [m²]
ENERGY_SCALE = BENDING_STIFFNESS * CURVATURE_SCALE**2


def linear_law(torsion_ratio: float = TORSION_RATIO) -> LinearLaw:
    """Π = −V₀ Σp + ½ EI (u₁² + u₂²) + ½ GJ u₃²: straight at any pressure, linear in the moment."""
    stiffness = BENDING_STIFFNESS * jnp.diag(jnp.array([1.0, 1.0, torsion_ratio]))
    return LinearLaw(stiffness, jnp.zeros((3, 3)), REST_VOLUME)


def bending_law(symmetry: str = "mirror") -> RidgeNetwork:
    """Law with the actuator's sizes: one chamber at full pressure bends it by some 50 1/m to its far side.

    Chambers 2 and 3 twist it a little too. The stiffness varies by tens of per cent with pressure and
    curvature.
    """
    law = law_from_arrays(calibrations.ridge_arrays(symmetry=symmetry))
    assert isinstance(law, RidgeNetwork)
    return law


def ridge_law(seed: int = 0, *, symmetry: str = "mirror", ridges: int = 8) -> RidgeNetwork:
    """Random network of ridges with the actuator's stiffness: pressures bend it by some 20 1/m."""
    rng = np.random.default_rng(seed)
    features = 6
    arrays = {
        "feature_weights": rng.normal(size=(features, 3)),
        "feature_biases": 0.3 * rng.normal(size=features),
        "directions": rng.normal(size=(ridges, 3)),
        "mixing": 0.5 * rng.normal(size=(ridges, 3 + features)),
        "offsets": rng.normal(size=ridges),
        "weights": 0.1 * rng.normal(size=ridges),
        "factor": np.sqrt([1.0, 0.0, 1.0, 0.0, 0.0, TORSION_RATIO]),
        "slopes": 0.1 * rng.normal(size=3 + features),
        "guess": 0.05 * rng.normal(size=(3, 3 + features)),
    }
    return RidgeNetwork(
        **{name: jnp.asarray(array) for name, array in arrays.items()},
        pressure_scale=FULL_PRESSURE,
        curvature_scale=CURVATURE_SCALE,
        energy_scale=ENERGY_SCALE,
        rest_volume=REST_VOLUME,
        symmetry=symmetry,
    )


def calibration(law: RidgeNetwork | None = None, psi: float = 0.0) -> rodmodel.Calibration:
    """Calibration around a law, by default the bending one."""
    return rodmodel.Calibration(
        layout=rodmodel.Layout("double-helix", psi, 3e-3),
        actuator=ACTUATOR,
        section_law=bending_law() if law is None else law,
        domain=DOMAIN,
        error={
            "free_bending_angle_rad": {"median": 0.004, "p95": 0.016, "worst": 0.05},
            "states": 100,
        },
        provenance={"command": "none: a synthetic law"},
    )


def rod(law: rodmodel.SectionLaw) -> rodmodel.Rod:
    """Rod of the actuator's sizes around a law."""
    return rodmodel.Rod(law, ACTUATOR, DOMAIN, 0.016)
