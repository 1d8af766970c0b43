"""`--design FILE`: the file's actuator is computed, and single options change it."""

import argparse
import json
from dataclasses import replace

import numpy as np
import pytest

from fem_reference import (
    LEVELS,
    Actuator,
    ActuatorGeometry,
    Core,
    Design,
    DoubleHelix,
    Load,
    PeriodCell,
    Ring,
    Thread,
    design_text,
)
from fem_reference.cli import main
from fem_reference.cli._actuator import _description, _design
from fem_reference.cli._arguments import Parser, add_actuator, design_of
from fem_reference.materials import Yeoh
from tests.fem_fixtures import TINY

#: Differs from the paper's in every part.
OWN = Design(
    "own",
    ActuatorGeometry(body_length=40e-3, outer_wall=1.2e-3, winding_diameter=11e-3),
    Yeoh((0.04e6, 0.001e6)),
    Core(50e6),
    Thread(3e9, 0.1e-3, slack_share=0.5),
    DoubleHelix(0.2, 2.5e-3),
    density=1200.0,
    bonded="tip",
    cap_wound=True,
    end_compliance=0.5e-3,
)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(design_text(OWN))
    return str(path)


@pytest.fixture
def tiny(monkeypatch):
    """Meshes of the fewest elements, which the command's flags do not offer."""
    for name in LEVELS:
        monkeypatch.setitem(LEVELS, name, TINY)


def design_from(*arguments: str) -> Design:
    parser = Parser()
    add_actuator(parser.add_argument, None)
    return design_of(parser.parse_args(arguments))


def test_without_the_option_it_is_the_papers():
    assert design_from() == Design()


def test_the_file_alone_is_taken_as_it_is(file):
    assert design_from("--design", file) == OWN


def test_single_options_change_what_they_name_alone(file):
    changed = design_from("--design", file, "--psi-deg", "90", "--inner-wall-mm", "1.4")
    assert changed.winding == DoubleHelix(np.pi / 2.0, 2.5e-3)
    assert changed.geometry.inner_wall == 1.4e-3
    assert (changed.geometry.body_length, changed.thread, changed.core) == (40e-3, OWN.thread, OWN.core)
    # Rings at half the pitch need the thread of the helices.
    assert design_from("--design", file, "--layout", "ring").winding == Ring(1.25e-3)


def test_the_cell_of_the_file_is_that_of_its_parts(file, tiny, capsys):
    assert main(["cell", "--design", file, "--pressure-kpa", "4", "1", "0", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    cell = PeriodCell(
        OWN.geometry, OWN.winding, TINY, OWN.material, OWN.thread, OWN.end_compliance, core=OWN.core
    )
    state = cell.solve(Load((4e3, 1e3, 0.0)))
    np.testing.assert_allclose(told["curvature_per_m"], state.curvature, rtol=1e-6, atol=1e-7)
    assert told["stretch"] > 1.0
    assert told["bending_angle_deg"] == pytest.approx(
        np.degrees(0.04 * np.hypot(*state.curvature[:2])), rel=1e-6
    )


def test_the_cell_says_the_length_that_it_speaks_of(file, tiny, capsys):
    assert main(["cell", "--design", file, "--pressure-kpa", "1", "0", "0"]) == 0
    assert "deg over 40 mm, uniformly bent" in capsys.readouterr().out


def test_a_stiffer_core_bends_less(tiny):
    soft, stiff = (
        PeriodCell(level=TINY, core=Core(modulus)).solve(Load((4e3, 0.0, 0.0))).curvature[1]
        for modulus in (5e6, 500e6)
    )
    # EI of the section is 2.4e-4 N m² and of the cores 4e-6 and 4e-4: curvatures go as one over the sum.
    assert abs(stiff) / abs(soft) == pytest.approx((2.4e-4 + 3.93e-6) / (2.4e-4 + 3.93e-4), rel=0.05)


def test_the_actuator_of_a_design_has_its_parts():
    actuator = Actuator.of(OWN, TINY)
    model = actuator.model
    assert (model.geometry, model.material, model.winding) == (OWN.geometry, OWN.material, OWN.winding)
    assert (model.thread, model.core, model.density) == (OWN.thread, OWN.core, 1200.0)
    assert (model.bonded, model.cap_wound) == ("tip", True)
    softer = Actuator.of(replace(OWN, core=Core(5e6)), TINY)
    bending, less = (of.equations.axis.bending for of in (actuator, softer))
    np.testing.assert_allclose(bending, 10.0 * less, rtol=0, atol=1e-12 * np.abs(bending).max())


def test_options_of_the_actuator_change_the_design(file):
    options = argparse.Namespace(
        design=file,
        layout=None,
        psi_deg=None,
        pitch_mm=None,
        spacing_mm=None,
        outer_wall_mm=None,
        inner_wall_mm=None,
        partition_wall_mm=None,
        outer_wall_variation=None,
        density_kg_per_m3=["1100"],
        slack_share=["0.25"],
        bonded="all",
    )
    changed = _design(options)
    assert (changed.density, changed.thread.slack_share, changed.bonded) == (1100.0, 0.25, "all")
    assert changed.thread.young_modulus == 3e9


def test_a_run_of_the_papers_actuator_is_described_as_before_designs():
    """Its directory was written without a core and a range of stretch; it resumes."""
    model = _description(Actuator.of(Design(), TINY), [])["model"]
    assert "core" not in model
    assert set(model["material"]) == {"shear_moduli", "exponents", "bulk_modulus"}
    own = _description(Actuator.of(OWN, TINY), [])["model"]
    assert own["core"] == {"young_modulus": 50e6}
    assert own["material"]["law"] == "Yeoh"


@pytest.mark.parametrize("command", ["cell", "actuator"])
def test_a_faulty_file_is_refused_in_one_line_with_its_key(command, tmp_path, capsys):
    faulty = tmp_path / "faulty.toml"
    faulty.write_text(design_text(Design()).replace("pitch_mm = 3", "pitch_mm = 0.003"))
    assert main([command, "--design", str(faulty), "--pressure-kpa", "1", "0", "0"]) == 2
    out, told = capsys.readouterr()
    assert out == ""
    assert told.count("\n") == 1
    assert f"{faulty}, line" in told
    assert "winding.pitch_mm: got 0.003, expected a number from 0.01 to 500 mm; is it in metres?" in told
