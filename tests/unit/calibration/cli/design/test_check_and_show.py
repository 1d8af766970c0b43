"""`rodmodel-design check` tells all faults; `show` tells what follows from a design, and draws it."""

import json
import math
import subprocess
import sys
from pathlib import Path

import pytest

from calibration.cli.design import main
from fem_reference import ActuatorGeometry, Design, Ring, design_text, parse_design

ROOT = Path(__file__).parents[5]
DESIGNS = ROOT / "designs"
FAULTY = (
    (DESIGNS / "paper.toml")
    .read_text()
    .replace("body_length_mm = 60", "body_length_mm = 0.06")
    .replace('name = "kevlar"', 'name = "steel"')
)


@pytest.mark.parametrize("name", ["paper", "half", "ecoflex20"])
def test_the_designs_that_ship_are_valid(name, capsys):
    file = str(DESIGNS / f"{name}.toml")
    assert main(["check", file]) == 0
    assert capsys.readouterr() == (f"{file}: {name} is a valid design\n", "")
    assert main(["check", file, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"file": file, "valid": True, "faults": []}


def test_all_faults_are_told_a_line_each(tmp_path, capsys):
    file = tmp_path / "faulty.toml"
    file.write_text(FAULTY)
    assert main(["check", str(file)]) == 2
    out, told = capsys.readouterr()
    assert out == ""
    first, second = told.splitlines()
    assert first.startswith(f"{file}, line 12: dimensions.body_length_mm: got 0.06, expected")
    assert first.endswith("is it in metres?")
    assert second.startswith(f"{file}, line 29: thread.name: got")
    assert main(["check", str(file), "--json"]) == 2
    told = json.loads(capsys.readouterr().out)
    assert told["valid"] is False
    assert [(fault["line"], fault["key"]) for fault in told["faults"]] == [
        (12, "dimensions.body_length_mm"),
        (29, "thread.name"),
    ]


def test_show_refuses_a_faulty_file_in_one_line(tmp_path, capsys):
    file = tmp_path / "faulty.toml"
    file.write_text(FAULTY)
    assert main(["show", str(file)]) == 2
    out, told = capsys.readouterr()
    assert out == ""
    assert told.count("\n") == 1
    assert "and 1 more, see `rodmodel-design check`" in told


def test_show_tells_what_follows_from_the_papers_design(capsys):
    assert main(["show", str(DESIGNS / "paper.toml"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["chamber_area_mm2"] == pytest.approx([15.6] * 3, abs=0.05)
    assert told["shear_modulus_kpa"] == pytest.approx(100.36)
    assert told["thread_angle_deg"] == pytest.approx(math.degrees(math.atan(math.pi * 11.2 / 3.0)))
    # Two helices of twenty turns.
    assert told["threads"] == 2
    assert told["thread_length_mm"] == pytest.approx(2 * 20 * math.hypot(math.pi * 11.2, 3.0), rel=1e-4)
    disc = math.pi / 4.0 * 0.012**2
    body = disc - 3.0 * ActuatorGeometry().chamber_area
    assert told["mass_g"] == pytest.approx(1070e3 * (60e-3 * body + 6e-3 * disc))
    assert told["like"]["similar"] is True
    assert parse_design(told["toml"]).name == "paper"


def test_show_tells_the_factors_of_a_similar_design(capsys):
    assert main(["show", str(DESIGNS / "half.toml")]) == 0
    told = capsys.readouterr().out
    assert (
        "similar to paper: lengths × 0.5, moduli × 1, pressures × 1, moments × 0.125, forces × 0.25" in told
    )


def test_show_tells_what_makes_a_design_another_one(tmp_path, capsys):
    file = tmp_path / "thick.toml"
    file.write_text(design_text(Design("thick", ActuatorGeometry(outer_wall=1.1e-3), winding=Ring())))
    assert main(["show", str(file), "--like", str(DESIGNS / "half.toml"), "--json"]) == 0
    like = json.loads(capsys.readouterr().out)["like"]
    assert (like["name"], like["similar"], like["length"]) == ("half", False, 2.0)
    assert set(like["deviations"]) == {"outer_wall", "layout", "psi", "pitch", "spacing"}


@pytest.mark.parametrize("name", ["plot.txt", "absent/plot.png"])
def test_a_picture_that_cannot_be_written_is_refused(name, tmp_path, capsys):
    assert main(["show", str(DESIGNS / "half.toml"), "--plot", str(tmp_path / name)]) == 2
    assert "--plot: got" in capsys.readouterr().err


def test_a_base_install_checks_shows_and_draws(tmp_path):
    """Without gmsh and the other packages of the finite elements; then the section has no mesh."""
    script = f"""
import sys
of_the_fem = {{"gmsh", "skfem", "ipctk", "pypardiso", "meshio", "xarray", "distributed"}}
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in of_the_fem:
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Absent())
from calibration.cli.design import main
assert main(["check", {str(DESIGNS / "paper.toml")!r}]) == 0
assert main(["show", {str(DESIGNS / "paper.toml")!r}, "--plot", {str(tmp_path / "paper.png")!r}]) == 0
"""
    run = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False, cwd=ROOT
    )
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "paper.png").stat().st_size > 10_000


def test_a_design_by_the_test_of_its_silicone_is_fitted(tmp_path, capsys):
    """A neo-Hookean solid of 50 kPa, pulled to a stretch of 2."""
    stretches = [1.0 + 0.05 * k for k in range(21)]
    rows = [f"{x:.4f},{0.05 * (x - x**-2):.8f}" for x in stretches]
    (tmp_path / "pull.csv").write_text("\n".join(["stretch,nominal stress [MPa]", *rows]) + "\n")
    text = design_text(Design("pulled"))
    begin, end = text.index('model = "ogden"'), text.index("density_kg_per_m3")
    file = tmp_path / "pulled.toml"
    file.write_text(f'{text[:begin]}test = "pull.csv"\n{text[end:]}')
    assert main(["show", str(file), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["shear_modulus_kpa"] == pytest.approx(50.0, rel=1e-3)
    # The canonical text holds the constants, so that no file is needed beside it.
    assert parse_design(told["toml"]).material.shear_modulus == pytest.approx(50e3, rel=1e-3)
    (tmp_path / "pull.csv").write_text("nothing\n")
    assert main(["check", str(file)]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert "material.test: " in line
