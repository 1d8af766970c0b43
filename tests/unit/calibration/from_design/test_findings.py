"""What a calibration from a design tells: as JSON, and as a page with all stages."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from calibration.cli._arguments import json_text
from calibration.from_design import Budget, Findings, Task, report
from calibration.from_design.judge_stage import RodErrors, bars, summary
from calibration.from_design.mesh_check import MeshCheck
from calibration.from_design.pressure_range import ANGLE, STABILITY, PathEnd
from fem_reference import Design
from rodmodel import Layout, shipped_calibrations

OWN = next(c for c in shipped_calibrations() if c.layout == Layout("double-helix", 0.0, 3e-3))
LENGTH = float(OWN.actuator.body_length)


@pytest.fixture
def found(tmp_path) -> Findings:
    errors = RodErrors(
        case=np.array(["fit-chamber1", "judge-chamber2", "judge-chamber2"]),
        role=np.array(["fit", "judge", "judge"]),
        pressure=np.array([[20e3, 0.0, 0.0], [0.0, 15e3, 0.0], [0.0, 45e3, 0.0]]),
        judged=np.array([True, True, False]),
        angle=np.array([0.3, 0.2, 1.2]),
        rod_angle=np.array([0.3, 0.21, 1.25]),
        angle_error=np.array([0.0, 0.01, 0.05]),
        tip_error=np.array([0.0, 6e-4, 3e-3]),
        angle_off=np.array([0.0, 0.012, 0.06]),
        tip_off=np.array([0.0, 7e-4, 3e-3]),
        base_moment=np.zeros(3),
    )
    judged = summary(errors, LENGTH)
    return Findings(
        task=Task(Design(name="<own>"), Budget(1200.0), tmp_path, "the command"),
        ends=(
            PathEnd((1,), 60e3, math.pi, ANGLE, "the wanted angle", (30e3, 60e3), (1.0, math.pi), 0.5),
            PathEnd((2, 3), 40e3, 2.0, STABILITY, "the section loses its stability", (40e3,), (2.0,), 0.5),
        ),
        mesh=MeshCheck(((45e3, 0.0, 0.0), (0.0, 30e3, 30e3)), (1.0, 1.98), (1.0, 2.0), (1.0, 1.98), 0.5),
        plan={"paths": 20, "states": 180},
        calibration=replace(OWN, provenance={**OWN.provenance, "fit_start": "from scratch"}),
        errors=errors,
        judged=judged,
        bars=bars(OWN, judged),
        notes=("A note.",),
        figures=tmp_path,
    )


def test_the_record_is_one_object_of_json_in_kilopascals_and_degrees(found):
    record = json.loads(json_text(found.record()))
    assert [(end["chambers"], end["ends_at"]) for end in record["range"]] == [
        ([1], ANGLE),
        ([2, 3], STABILITY),
    ]
    assert record["range"][0]["pressure_kpa"] == pytest.approx(60.0)
    assert record["range"][0]["angle_deg"] == pytest.approx(180.0)
    assert record["mesh"]["two_chambers_percent"] == pytest.approx(1.0)
    assert record["judge"]["judged"] == 1
    assert record["judge"]["tip_percent"]["worst"] == pytest.approx(100.0 * 6e-4 / LENGTH)
    assert record["bars_met"]


def test_a_page_tells_of_all_stages(found):
    """Their headings, what was found, and two figures of its own; names are text."""
    text = report(found)
    for told in (
        "Range of pressures",
        "Mesh",
        "Sweep and law",
        "Rod against the full actuator",
        "Provenance",
    ):
        assert f"<h2>{told}</h2>" in text
    for told in ("the section loses its stability", "20 paths", "judge-chamber2, 0 15 0 kPa", "A note."):
        assert told in text
    assert "Calibration of &lt;own&gt;" in text
    assert text.count("data:image/png;base64,") == 2


def test_without_judge_states_no_bar_counts_as_met(found):
    none = replace(found, errors=None, judged={"states": 0, "judged": 0}, bars=bars(OWN, {}))
    assert none.short == ["judge runs, none of which lies in the domain"]
    assert not none.record()["bars_met"]
    assert "There is no run of the full actuator." in report(none)


def test_a_mesh_that_did_not_converge_is_null(found):
    lost = replace(found, mesh=replace(found.mesh, finer=(1.0, math.nan)))
    assert json.loads(json_text(lost.record()))["mesh"]["two_chambers_percent"] is None
