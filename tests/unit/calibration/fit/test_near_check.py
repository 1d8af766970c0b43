"""A law to begin with is of the run's actuator, or is refused with what differs."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import rodmodel
from calibration.fit import UnlikeError
from calibration.fit.same_section import cautions, refuse_another_actuator
from rodmodel import Domain
from rodmodel.io import Adjustment, adjusted, find

SHIPPED = Path(rodmodel.__file__).parent / "calibrations" / "double-helix_psi0_pitch3.json"


@pytest.fixture(scope="module")
def near():
    return rodmodel.read_calibration(SHIPPED)


@pytest.fixture
def run(near):
    kept = near.provenance
    return {
        "geometry": dict(kept["geometry_m"]),
        "material": {part: dict(numbers) for part, numbers in kept["material"].items()},
        "mesh": kept["mesh"],
        "end_compliance": kept["end_compliance_m_per_n"],
    }


def of_provenance(near, **changes):
    provenance = {**near.provenance, **changes}
    fields = {name: getattr(near, name) for name in ("layout", "actuator", "law", "domain", "error")}
    return rodmodel.Calibration(**fields, provenance={k: v for k, v in provenance.items() if v is not None})


def test_another_winding_of_the_same_actuator_is_taken(near, run):
    refuse_another_actuator(near, run)
    assert cautions(near, run, near.domain) == []
    assert cautions(near, run, Domain((60e3, 60e3, 60e3), 110e3, 6.6e-3, 3.3e-3)) == []


def test_another_geometry_is_refused_by_name(near, run):
    run["geometry"]["outer_wall"] = 1.2e-3
    with pytest.raises(UnlikeError, match=r"a law with geometry\.outer_wall 0\.001, expected 0\.0012"):
        refuse_another_actuator(near, run)


def test_another_material_is_refused_by_name(near, run):
    run["material"]["body"]["shear_moduli"] = [2000.0, 0.0, 0.0]
    with pytest.raises(UnlikeError, match=r"a law with material\.body\.shear_moduli .* expected \[2000"):
        refuse_another_actuator(near, run)


def test_a_file_that_says_nothing_of_its_geometry_has_lengths_all_the_same(near, run):
    silent = of_provenance(near, geometry_m=None, material=None, mesh=None)
    refuse_another_actuator(silent, run)
    assert cautions(silent, run, near.domain) == ["it does not say of which material it is"]
    run["geometry"]["body_length"] = 0.1
    with pytest.raises(UnlikeError, match=r"geometry\.body_length 0\.06, expected 0\.1"):
        refuse_another_actuator(silent, run)


def test_an_adjusted_law_is_no_start(near, run):
    mine = adjusted(
        find("double-helix", 0.0, 3e-3), Adjustment(1.0, np.ones(3), np.zeros(3), np.zeros(3)), {}, {}
    )
    with pytest.raises(UnlikeError, match="a law adjusted to measurements"):
        refuse_another_actuator(mine, run)


def test_mesh_compliance_and_domain_that_differ_are_told(near, run):
    wide = dataclasses.replace(near.domain, pressure_max=(108e3, 53e3, 53e3))
    found = cautions(near, {**run, "mesh": "paper", "end_compliance": 0.0}, wide)
    assert found[0] == "its mesh is coarse, the run's paper"
    assert found[1] == "its end_compliance is 0.00023, the run's 0.0"
    assert found[2].startswith("the fit reaches 2 times as far as its domain")
