"""Section laws, rods and calibrations of known behaviour, for tests: none of them calibrates anything."""

import itertools

import jax.numpy as jnp
import numpy as np

import rodmodel
from rodmodel import FreeStateExpansion, RidgeNetwork

BENDING_STIFFNESS = 2.45e-4  # EI [N m²]
TORSION_RATIO = 0.9  # GJ/EI
REST_VOLUME = 15.5e-6  # [m²]
CURVATURE_AT_FULL_PRESSURE = 52.0  # [1/m], one chamber
FULL_PRESSURE = 70e3  # [Pa]
CURVATURE_SCALE = 50.0
ENERGY_SCALE = BENDING_STIFFNESS * CURVATURE_SCALE**2

ACTUATOR = rodmodel.Actuator(
    body_length=0.06, cap_length=0.006, body_diameter=0.012, mass_per_length=0.068, cap_mass=0.73e-3
)
DOMAIN = rodmodel.Domain(pressure_max=(70e3, 60e3, 60e3), pressure_sum_max=100e3, moment_max=1.2e-3)

# Of the 35 outputs of the network: the diagonal of K, which has the indices 11, 12, 13, 22, 23, 33.
_K11, _K22, _K33 = 4, 7, 9


def linear_law(torsion_ratio: float = TORSION_RATIO) -> FreeStateExpansion:
    """Π = −V₀ Σp + ½ EI (u₁² + u₂²) + ½ GJ u₃²: straight at any pressure, linear in the moment."""
    bias = np.zeros(35)
    bias[[_K11, _K22, _K33]] = 1.0, 1.0, torsion_ratio
    return FreeStateExpansion(
        weights=(jnp.zeros((35, 3)),),
        biases=(jnp.asarray(bias),),
        pressure_scale=FULL_PRESSURE,
        curvature_scale=CURVATURE_SCALE,
        energy_scale=ENERGY_SCALE,
        rest_volume=REST_VOLUME,
    )


def bending_law(
    seed: int = 0,
    *,
    mirror: bool = True,
    pressure_warp: float | None = None,
    hidden: tuple[int, ...] = (16, 16),
) -> FreeStateExpansion:
    """Random law with the actuator's sizes: one chamber at full pressure bends it by 52 1/m to its far side.

    The hidden layers are random, and so is the last one but for the free curvature, whose weights fit a
    smooth curve by least squares. The stiffness varies by tens of per cent with pressure and curvature.
    """
    rng = np.random.default_rng(seed)
    sizes = [3, *hidden]
    weights = [rng.normal(size=(n, m)) / np.sqrt(m) for m, n in itertools.pairwise(sizes)]
    biases = [0.3 * rng.normal(size=n) for n in sizes[1:]]
    last = rng.normal(size=(35, sizes[-1]))
    last *= np.repeat([0.2, 0.1, 0.02, 0.01], [4, 6, 10, 15])[:, None] / np.sqrt(sizes[-1])
    bias = np.zeros(35)
    bias[[_K11, _K22, _K33]] = 1.0, 1.0, TORSION_RATIO

    pressure = FULL_PRESSURE * rng.uniform(size=(400, 3))
    if pressure_warp is None:
        features = pressure / FULL_PRESSURE
    else:
        features = np.arcsinh(pressure / pressure_warp) / np.arcsinh(FULL_PRESSURE / pressure_warp)
    at_rest = np.zeros((1, 3))
    for weight, offset in zip(weights, biases, strict=True):
        features, at_rest = np.tanh(features @ weight.T + offset), np.tanh(at_rest @ weight.T + offset)
    azimuth = 2.0 * np.pi / 3.0 * np.arange(3)
    growth = (pressure / FULL_PRESSURE) ** 1.3 * CURVATURE_AT_FULL_PRESSURE / CURVATURE_SCALE
    # Chambers 2 and 3 twist the rod a little, to opposite sides.
    free = growth @ np.stack([np.sin(azimuth), -np.cos(azimuth), [0.0, 0.08, -0.08]], axis=1)
    last[1:4] = np.linalg.lstsq(features - at_rest, free, rcond=None)[0].T
    return FreeStateExpansion(
        weights=tuple(map(jnp.asarray, [*weights, last])),
        biases=tuple(map(jnp.asarray, [*biases, bias])),
        pressure_scale=FULL_PRESSURE,
        curvature_scale=CURVATURE_SCALE,
        energy_scale=ENERGY_SCALE,
        rest_volume=REST_VOLUME,
        pressure_warp=pressure_warp,
        mirror=mirror,
    )


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


def calibration(law: FreeStateExpansion | None = None, psi: float = 0.0) -> rodmodel.Calibration:
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
