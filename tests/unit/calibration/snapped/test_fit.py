"""A sheet's law is found from its states; those that are held or lean elsewhere are left out."""

import jax.numpy as jnp
import numpy as np
import xarray as xr

from calibration.fit import equilibrium, free_curvatures, states_of
from calibration.snapped import SnappedSheet, fit_snapped, sheet_domain
from calibration.snapped.fit import continued, snapped_samples, upright_beside
from rodmodel.section import law_from_arrays
from tests.unit.rodmodel import calibrations

SHEET = SnappedSheet(2, 1)
DOMAIN = sheet_domain(SHEET, (40e3, 70e3), 10e3, 4e-4, 2e-4)
# The synthetic laws bend 60 mm by more than a turn.
LENGTH = 0.02


def dataset(count: int, seed: int) -> xr.Dataset:
    """States of a law that bends aside, under random loads of the domain; every fifth is held out."""
    rng = np.random.default_rng(seed)
    law = law_from_arrays(calibrations.snapped_law(2, 1).law)
    low, high = np.array(DOMAIN.pressure_min), np.array(DOMAIN.pressure_max)
    pressure = low + rng.random((count, 3)) * (high - low)
    moment = 2e-4 * rng.uniform(-1.0, 1.0, (count, 3)) * (np.arange(count) % 2)[:, None]
    psi = np.zeros(count)
    start = free_curvatures(law, jnp.asarray(pressure), jnp.asarray(psi))
    curvature, found = equilibrium(law, jnp.asarray(pressure), jnp.asarray(moment), start, jnp.asarray(psi))
    assert np.asarray(found).all()
    states = states_of([law], pressure, np.asarray(curvature), psi, "p")
    zeros = np.zeros(count, dtype=int)
    return xr.Dataset(
        {
            "pressure": (("state", "chamber"), pressure),
            "curvature": (("state", "axis"), states.curvature),
            "moment": (("state", "axis"), states.moment),
            "applied_moment": (("state", "axis"), moment),
            "volume": (("state", "chamber"), states.volume),
            "energy": ("state", np.zeros(count)),
            "hessian": (("state", "row", "column"), states.hessian),
            "stable": ("state", zeros + 1),
            "jumped": ("state", zeros),
            "held": ("state", zeros),
            "psi": ("state", psi),
            "path": ("state", np.array([f"{n:03d}" for n in range(count)])),
            "role": ("state", np.where(np.arange(count) % 5 == 4, "held-out", "train")),
        }
    )


def test_states_that_are_held_or_lean_to_the_other_side_are_left_out() -> None:
    states = dataset(12, 0)
    assert len(snapped_samples(states, SHEET)) == 12
    assert len(snapped_samples(states, SnappedSheet(2, -1))) == 0
    states["held"][3] = 1
    assert len(snapped_samples(states, SHEET)) == 11


def test_a_sheet_that_is_nearly_linear_is_found() -> None:
    """The planted one is of ridges, softer by a fifth at one end: some degrees of the fifty that it bends."""
    loading = law_from_arrays(calibrations.ridge_arrays())
    found = fit_snapped(dataset(100, 1), SHEET, loading, calibrations.DOMAIN, DOMAIN, LENGTH, 0.0)
    assert found.complaint == ""
    assert found.domain.pressure_max == DOMAIN.pressure_max
    assert found.domain.moment_max == 0.25 * DOMAIN.moment_max
    assert np.degrees(found.error["free_bending_angle_rad"]["p95"]) < 3.0
    assert found.training["upright_share"] == 0.0


def test_without_held_out_states_there_is_no_law() -> None:
    states = dataset(40, 2)
    states["role"][:] = "train"
    loading = law_from_arrays(calibrations.ridge_arrays())
    found = fit_snapped(states, SHEET, loading, calibrations.DOMAIN, DOMAIN, LENGTH, 0.0)
    assert found.complaint == "no held-out state lies on the sheet"


def test_upright_sections_are_continued_along_their_tangent() -> None:
    """Up to a pressure they are the law's; a little beyond it too, to the square of the distance."""
    loading = law_from_arrays(calibrations.ridge_arrays())
    samples = snapped_samples(dataset(12, 3), SHEET)
    most = 45e3
    near = continued(loading, SHEET, most, samples)
    exact = upright_beside(loading, samples)
    beyond = np.maximum(samples.pressure[:, 1] - most, 0.0)
    off = np.abs(near.curvature - exact.curvature).max(axis=1)
    volume = np.abs(near.volume - exact.volume).max(axis=1)
    np.testing.assert_array_equal(off[beyond == 0.0], 0.0)
    few = beyond < 5e3
    assert (beyond[few] > 0.0).any()
    ratio = off[beyond > 0.0] / beyond[beyond > 0.0] ** 2
    assert ratio.max() < 50.0 * np.median(ratio)
    assert np.all(volume[few] < 0.05 * np.abs(exact.volume[few]).max())
