"""Calibrations of known behaviour in NumPy, for tests that need no JAX: none of them calibrates anything."""

import dataclasses
import math

import numpy as np

from rodmodel import Actuator, Calibration, Domain, ErrorBound, Layout
from rodmodel.io import RidgeArrays, SnappedLaw

BENDING_STIFFNESS = 2.45e-4  # EI [N m²]
TORSION_RATIO = 0.9  # GJ/EI
CURVATURE_SCALE = 50.0  # [1/m]
FULL_PRESSURE = 70e3  # [Pa]

ACTUATOR = Actuator(
    body_length=0.06, cap_length=0.006, body_diameter=0.012, mass_per_length=0.068, cap_mass=0.73e-3
)
DOMAIN = Domain(pressure_max=(70e3, 60e3, 60e3), pressure_sum_max=100e3, moment_max=1.2e-3)
BOUND = ErrorBound(
    (0.0, 20e3, 90e3),
    (0.004, 0.008, 0.03),
    (1e-4, 3e-4, 2e-3),
    5.0,
    0.2,
    bending_angle=(0.0, 0.5, 1.5),
    angle_by_bend=(0.0, 0.001, 0.004),
    tip_by_bend=(0.0, 1e-5, 2e-4),
)


def ridge_arrays(*, symmetry: str = "mirror", oriented: bool = False) -> RidgeArrays:
    """Law of three ridges, one a chamber: at full pressure each bends the rod by some 50 1/m to its far side.

    Chambers 2 and 3 twist it a little, to opposite sides, and chamber 1 bends it a little more than they do:
    the section is its own mirror image. One hidden function of the pressures shifts the ridges a little.
    """
    azimuth = 2.0 * np.pi / 3.0 * np.arange(3)
    reach = 0.3
    twist = np.array([0.0, 0.08, -0.08])
    directions = reach * np.stack([np.sin(azimuth), -np.cos(azimuth), twist], axis=1)
    return RidgeArrays(
        feature_weights=np.array([[0.6, 0.6, 0.6]]),
        feature_biases=np.array([0.2]),
        directions=directions,
        mixing=np.concatenate([np.eye(3), np.full((3, 1), 0.05)], axis=1),
        offsets=np.array([0.02, 0.02, 0.02]),
        weights=np.array([1.4, 1.3, 1.3]) / reach,
        factor=np.sqrt([1.0, 0.0, 1.0, 0.0, 0.0, TORSION_RATIO]),
        slopes=np.array([-0.1, -0.1, -0.1, 0.02]),
        guess=np.concatenate([-directions.T / reach, np.zeros((3, 1))], axis=1),
        pressure_scale=FULL_PRESSURE,
        curvature_scale=CURVATURE_SCALE,
        energy_scale=BENDING_STIFFNESS * CURVATURE_SCALE**2,
        rest_volume=15.5e-6,
        symmetry="full" if oriented else symmetry,
        orientation_weights=np.array([[0.1, 0.05]]) if oriented else None,
    )


def calibration(law: RidgeArrays | None = None, layout: Layout | None = None) -> Calibration:
    """Calibration around a law, by default the one above, at ψ = 0."""
    return Calibration(
        layout=Layout("double-helix", 0.0, 3e-3) if layout is None else layout,
        actuator=ACTUATOR,
        law=ridge_arrays() if law is None else law,
        domain=DOMAIN,
        error={"free_bending_angle_rad": {"median": 0.004, "p95": 0.016, "worst": 0.05}, "states": 100},
        provenance={"command": "none: a synthetic law"},
    )


def snapped_law(chamber: int = 2, side: int = 1) -> SnappedLaw:
    """Law of a branch from 40 to 70 kPa that bends aside: the section is not its own mirror image."""
    upright = ridge_arrays(symmetry="none")
    aside = np.array(
        [math.cos(2.0 * math.pi / 3.0 * (chamber - 1)), math.sin(2.0 * math.pi / 3.0 * (chamber - 1)), 0.0]
    )
    directions = upright.directions.copy()
    directions[chamber - 1] += 0.1 * side * aside
    own = np.eye(3)[chamber - 1]
    domain = Domain(
        pressure_max=tuple((70e3 * own + 15e3 * (1.0 - own)).tolist()),
        pressure_sum_max=85e3,
        moment_max=1.2e-3,
        pressure_min=tuple((40e3 * own).tolist()),
    )
    return SnappedLaw(
        chamber,
        side,
        dataclasses.replace(upright, directions=directions),
        domain,
        {"states": 30},
        {"command": "none"},
    )


def with_snapped(*sheets: tuple[int, int]) -> Calibration:
    """Calibration whose loading branch ends at 60 kPa in chamber 2, with snapped branches."""
    return dataclasses.replace(calibration(), snapped=tuple(snapped_law(*sheet) for sheet in sheets))


def oriented_calibration() -> Calibration:
    """Calibration of all orientations ψ."""
    return calibration(ridge_arrays(oriented=True), Layout("double-helix", None, 3e-3))


def of_twelve_degrees() -> Calibration:
    """Calibration at ψ = 12°, whose section is not its own mirror image."""
    return calibration(ridge_arrays(symmetry="none"), Layout("double-helix", math.radians(12), 3e-3))
