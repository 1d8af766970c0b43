"""The ends of a design's actuator: whose compliance, and whose numbers."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from calibration.ends import Compliance
from calibration.from_design import ends_stage as stage
from calibration.from_design.near_law import near_laws
from calibration.sweep import usual_end_compliance
from fem_reference import Design
from rodmodel import Domain, Layout, shipped_calibrations

OWN = next(c for c in shipped_calibrations() if c.layout == Layout("double-helix", 0.0, 3e-3))
NOTHING = xr.Dataset()


def found(value):
    return lambda *_: Compliance(value, 0.0, 0.0, 0.0, 4)


def test_the_designs_own_compliance_is_kept():
    design = replace(Design(), end_compliance=0.4e-3)
    assert stage.end_compliance(design, NOTHING) == {"value": 0.4e-3, "from": "the design"}


def test_else_it_is_fitted_to_the_runs(monkeypatch):
    monkeypatch.setattr(stage, "fit_compliance", found(0.3e-3))
    told = stage.end_compliance(Design(), NOTHING)
    assert (told["value"], told["from"]) == (0.3e-3, "the runs")


@pytest.mark.parametrize("wrong", [-0.1e-3, 5e-3])
def test_a_fit_that_no_end_can_have_is_not_taken(monkeypatch, wrong):
    """Negative, or several times that of similar actuators."""
    monkeypatch.setattr(stage, "fit_compliance", found(wrong))
    told = stage.end_compliance(Design(), NOTHING)
    assert told["value"] == usual_end_compliance(Design())
    assert told["from"] == "similar actuators"


def test_without_fit_runs_the_ends_are_those_of_the_most_similar_calibration():
    """For a design that is the paper's, these are the shipped ones."""
    made = stage.with_ends(OWN, None, near_laws(Design())[0], {"value": 0.23e-3}, {"command": "it"})
    assert made.actuator == OWN.actuator
    assert made.provenance["ends"]["from_shipped"]["layout"] == "double-helix, pitch 3 mm, ψ = 0°"
    assert made.bound is None


def test_one_fit_run_in_the_domain_is_too_few(monkeypatch: pytest.MonkeyPatch):
    """States beyond the law's domain tell of a section that has given way."""
    seen: list[list[str]] = []
    monkeypatch.setattr(stage, "fit_ends", lambda runs, *_: seen.append(runs["case"].values.tolist()))

    def runs(second: float) -> xr.Dataset:
        pressures = [10e3, second, 80e3, 10e3]
        return xr.Dataset(
            {
                "pressure": (("state", "chamber"), np.outer(pressures, [1.0, 0.0, 0.0])),
                "tip_force": (("state", "axis"), np.zeros((4, 3))),
                "gravity": (("state", "axis"), np.zeros((4, 3))),
                "stable": (("state",), np.ones(4, dtype=int)),
                "jumped": (("state",), np.zeros(4)),
                "case": (("state",), np.array(["fit-one", "fit-two", "fit-two", "judge-one"], dtype=object)),
                "role": (("state",), np.array(["fit", "fit", "fit", "judge"], dtype=object)),
            }
        )

    domain = Domain((50e3, 50e3, 50e3), 80e3, 2e-3)
    assert stage.ends_of(Design(), runs(60e3), 0.23e-3, domain) is None
    assert not seen
    stage.ends_of(Design(), runs(40e3), 0.23e-3, domain)
    assert seen == [["fit-one", "fit-two"]]
