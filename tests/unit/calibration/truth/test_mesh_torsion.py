"""A law with another torsional stiffness: the same bending, and the law of its mesh again."""

from dataclasses import replace

import numpy as np
import pytest

import rodmodel
from calibration.from_design import design_of
from calibration.truth import MeshLimits, carried, load_limits, on_its_mesh, torsion_ratio
from calibration.truth.mesh_torsion import at_limit
from fem_reference import Design
from rodmodel import Calibration
from rodmodel.io import find_among
from tests.unit.rodmodel.sections import section_at

SHIPPED = {(c.layout.name, c.layout.psi, c.layout.pitch): c for c in rodmodel.shipped_calibrations()}
OWN = SHIPPED["double-helix", 0.0, 3e-3]
FITTED = on_its_mesh(OWN)
PRESSURE = np.array([30e3, 8e3, 0.0])
CURVATURE = np.array([-3.0, 12.0, 5.0])


@pytest.mark.parametrize("key", SHIPPED)
def test_torsion_has_the_ratio_and_bending_is_as_it_was(key: tuple[str, float | None, float]) -> None:
    """At a twist that is less by the root of the ratio; so work is the same on both."""
    fitted = on_its_mesh(SHIPPED[key])
    made, s = carried(fitted, {"ratio": 0.81}), np.array([1.0, 1.0, 0.9])
    first, second = (rod_of(c) for c in (fitted, made))
    at = [section_at(rod.handle, u, PRESSURE) for rod, u in ((first, CURVATURE), (second, CURVATURE / s))]
    np.testing.assert_allclose(at[1].moment, s * at[0].moment, rtol=1e-10, atol=1e-15)
    np.testing.assert_allclose(at[1].stiffness, np.outer(s, s) * at[0].stiffness, rtol=1e-10, atol=1e-15)
    np.testing.assert_allclose(at[1].volume, at[0].volume, rtol=1e-10)
    assert at[1].energy == pytest.approx(at[0].energy, rel=1e-10)
    free = [rod.solve_many(pressure=PRESSURE)["free_curvature"][0] for rod in (first, second)]
    np.testing.assert_allclose(s * free[1], free[0], rtol=1e-8, atol=1e-8)
    axes = [c.domain.moment_axes for c in (fitted, made)]
    np.testing.assert_allclose(axes[1], s * axes[0], rtol=1e-12)


def test_the_law_of_its_mesh_is_found_again() -> None:
    twice = carried(carried(FITTED, {"ratio": 0.7}), {"ratio": 0.8})
    assert torsion_ratio(FITTED) == 1.0
    assert torsion_ratio(twice) == 0.8
    again = on_its_mesh(twice)
    for name in ("directions", "factor", "guess", "mixing"):
        np.testing.assert_allclose(getattr(again.law, name), getattr(FITTED.law, name), rtol=1e-14)
    assert again.provenance == FITTED.provenance


def test_an_actuator_that_the_study_does_not_know_stays_as_it_is() -> None:
    thicker = replace(Design(), geometry=replace(Design().geometry, outer_wall=1.1e-3))
    assert at_limit(FITTED, thicker, {}) is FITTED
    pitch = SHIPPED["double-helix", 0.0, 4e-3]
    assert at_limit(pitch, design_of(pitch), {}) is pitch
    known = at_limit(FITTED, design_of(FITTED), {"date": "today"})
    assert at_limit(known, design_of(known), {}) is known
    assert known.provenance["torsion"]["date"] == "today"


def test_laws_that_ship_are_at_the_limit_where_it_is_known() -> None:
    limits: MeshLimits = load_limits()
    for calibration in SHIPPED.values():
        found = limits.torsion_ratio(calibration.layout, calibration.provenance["mesh"])
        assert torsion_ratio(calibration) == (1.0 if found is None else found.ratio)


def rod_of(calibration: Calibration) -> rodmodel.CoreRod:
    layout = calibration.layout
    psi = 0.3 if layout.psi is None else layout.psi
    return rodmodel.CoreRod.of(find_among([calibration], layout.name, psi, layout.pitch))
