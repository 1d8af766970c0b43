"""`rodmodel-calibrate scale`: a law of the paper's actuator for one of other size and material."""

import json
import re
from pathlib import Path

import pytest

from calibration.cli import main
from calibration.truth import torsion_ratio
from fem_reference import Design, design_text, parse_design
from rodmodel import read_calibration

SHIPPED = Path("rodmodel/calibrations/double-helix_psi0_pitch3.json")


def design_file(tmp_path, **changes: float) -> Path:
    """The paper's design with other numbers, by key."""
    text = design_text(Design())
    for key, value in changes.items():
        text, count = re.subn(rf"^{key} = .*$", f"{key} = {value!r}", text, flags=re.MULTILINE)
        assert count == 1, key
    file = tmp_path / "mine.toml"
    file.write_text(text)
    return file


def test_the_paper_is_similar_to_itself(tmp_path, capsys):
    out = tmp_path / "same.json"
    assert (
        main(["scale", str(SHIPPED), "--design", str(design_file(tmp_path)), "--out", str(out), "--json"])
        == 0
    )
    assert json.loads(capsys.readouterr().out) == {"length": 1.0, "modulus": 1.0, "density": 1.0}
    before, after = read_calibration(SHIPPED), read_calibration(out)
    assert after.actuator == before.actuator
    assert after.domain == before.domain
    assert after.provenance["scaled"]["provenance"] == before.provenance
    # Its torsion has been carried to the limit, and is not again.
    assert torsion_ratio(after) == torsion_ratio(before) < 1.0


def test_half_the_size_takes_the_same_pressures(tmp_path, capsys):
    out = tmp_path / "half.json"
    assert main(["scale", str(SHIPPED), "--design", "designs/half.toml", "--out", str(out)]) == 0
    assert "lengths × 0.5" in capsys.readouterr().out
    before, after = read_calibration(SHIPPED), read_calibration(out)
    assert after.domain.pressure_max == pytest.approx(before.domain.pressure_max, rel=1e-12)
    assert after.actuator.body_length == pytest.approx(30e-3, rel=1e-12)
    assert after.layout.pitch == pytest.approx(1.5e-3, rel=1e-12)
    # A scaled file tells its own design, so that it can be scaled again.
    assert parse_design(after.provenance["design"]).geometry.body_diameter == pytest.approx(6e-3)
    again = tmp_path / "again.json"
    assert main(["scale", str(out), "--design", "designs/paper.toml", "--out", str(again)]) == 0
    assert read_calibration(again).domain.moment_max == pytest.approx(before.domain.moment_max, rel=1e-9)


def test_a_design_of_other_walls_is_refused_with_what_differs(tmp_path, capsys):
    file = design_file(tmp_path, outer_wall_mm=1.1)
    out = tmp_path / "no.json"
    assert main(["scale", str(SHIPPED), "--design", str(file), "--out", str(out)]) == 2
    assert "outer_wall +9.1 %" in capsys.readouterr().err
    assert not out.exists()
