"""The shipped calibration that is most like a design, scaled to it."""

import math
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from calibration.from_design import design_of
from calibration.from_design.near_law import near_laws
from calibration.truth import on_its_mesh
from fem_reference import Design, DoubleHelix, Ring
from rodmodel import Layout, shipped_calibrations
from tests.similar_designs import scaled

PAPER = Design()


def test_the_law_of_a_similar_design_is_its_own():
    """No difference is left, and the law's free curvature is 1/λ at μ times the pressures."""
    nearest = near_laws(scaled(PAPER, 2.0, 0.25))[0]
    assert nearest.title == "double-helix, pitch 3 mm, ψ = 0°"
    assert nearest.distance == pytest.approx(0.0, abs=1e-9)
    layout = Layout("double-helix", 0.0, 3e-3)
    own = on_its_mesh(next(c for c in shipped_calibrations() if c.layout == layout))
    law, other = nearest.calibration.section_law, own.section_law
    found, known = (
        law.free_curvature(jnp.array([5e3, 2e3, 0.0])),
        other.free_curvature(jnp.array([20e3, 8e3, 0.0])),
    )
    np.testing.assert_allclose(2.0 * np.asarray(found), np.asarray(known), rtol=1e-9)


@pytest.mark.parametrize(
    ("winding", "title"),
    [
        (Ring(), "ring, pitch 3 mm"),
        (DoubleHelix(psi=math.radians(80.0)), "double-helix, pitch 3 mm, any ψ"),
        (DoubleHelix(psi=math.radians(90.0)), "double-helix, pitch 3 mm, ψ = 90°"),
        (DoubleHelix(pitch=5.2e-3), "double-helix, pitch 6 mm, ψ = 0°"),
        # Half a turn is a shift along the rod.
        (DoubleHelix(psi=math.radians(192.0)), "double-helix, pitch 3 mm, ψ = 12°"),
    ],
)
def test_the_most_similar_winding_comes_first(winding, title):
    assert near_laws(replace(PAPER, winding=winding))[0].title == title


def test_another_layout_is_further_than_any_number():
    found = near_laws(replace(PAPER, winding=DoubleHelix(pitch=12e-3)))
    others = [near for near in found if "layout" in near.deviations]
    assert found[-len(others) :] == tuple(others)
    assert others


def test_the_masses_are_those_of_the_design():
    """Twice the density, twice the mass."""
    one, two = (
        near_laws(replace(PAPER, density=density))[0].calibration.actuator for density in (1070.0, 2140.0)
    )
    assert two.cap_mass == pytest.approx(2.0 * one.cap_mass)
    assert two.mass_per_length == pytest.approx(2.0 * one.mass_per_length)


def test_a_shipped_file_is_of_the_papers_parts():
    """Those from before designs tell their geometry and material alone."""
    shipped = next(c for c in shipped_calibrations() if c.layout.name == "ring")
    assert design_of(shipped) == replace(PAPER, winding=Ring())
