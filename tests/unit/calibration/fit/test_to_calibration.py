"""The calibration of a law: masses, layout and origin are those of the run's design."""

import math
from dataclasses import replace

import pytest

from calibration.fit import calibration_of
from calibration.sweep import attributes
from fem_reference import design_text, parse_design
from rodmodel import Layout, shipped_calibrations

OWN = next(c for c in shipped_calibrations() if c.layout == Layout("double-helix", 0.0, 3e-3))


def made_of(run):
    return calibration_of(OWN.section_law, OWN.domain, OWN.error, run, {"date": "2026-01-01"})


@pytest.fixture
def run(dataset):
    return attributes(dataset)


@pytest.mark.parametrize("density", [1070.0, 1500.0])
def test_the_masses_are_those_of_the_designs_density(run, density):
    """Of the cap, that of a disc; of a length of the body, that of silicone and core."""
    design = replace(parse_design(run["design"]), density=density)
    actuator = made_of({**run, "design": design_text(design)}).actuator
    geometry = design.geometry
    disc = math.pi / 4.0 * geometry.body_diameter**2
    core = math.pi / 4.0 * geometry.cavity_diameter**2
    assert actuator.cap_mass == pytest.approx(density * disc * geometry.cap_length)
    assert actuator.mass_per_length == pytest.approx(density * (geometry.body_area + core))


def test_a_run_from_before_designs_has_the_density_of_silicone(run):
    older = {name: value for name, value in run.items() if name != "design"}
    assert made_of(older).actuator == made_of(run).actuator
    assert "design" not in made_of(older).provenance


def test_a_calibration_names_its_design(run):
    assert made_of(run).provenance["design"] == run["design"]
