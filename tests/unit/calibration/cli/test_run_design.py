"""`rodmodel-calibrate run --design FILE`: the run is that of the file's actuator, and of no other."""

import json
import re
from pathlib import Path

import pytest

from calibration.cli import main
from fem_reference import Design, design_text, parse_design, read_design

DESIGNS = Path(__file__).parents[4] / "designs"
HALF = (DESIGNS / "half.toml").read_text()


@pytest.fixture
def started(monkeypatch, capsys, tmp_path):
    """Exit status, stderr and `run.json` of a run that is stopped before its first state."""

    def nothing(*arguments):
        yield from ()

    monkeypatch.setattr("calibration.sweep.sweep.trace_in_processes", nothing)

    def call(*arguments):
        status = main(["run", "--out", str(tmp_path / "run"), "--paths", "1", *arguments])
        told = capsys.readouterr().err
        return status, told, json.loads((tmp_path / "run" / "run.json").read_text())

    return call


def test_the_run_holds_the_design_and_its_pressures(started):
    file = DESIGNS / "ecoflex20.toml"
    status, _, run = started("--design", str(file))
    assert status == 3  # no state was found
    design = read_design(file)
    assert parse_design(run["design"]) == design
    assert run["design"] == design_text(design)
    assert run["geometry"]["body_diameter"] == 0.02
    assert run["winding"] == {"psi": 0.0, "pitch": 5e-3}
    assert run["end_compliance"] == 0.952e-3
    assert run["domain"]["pressure_max"] == [8.7e3] * 3
    assert run["domain"]["pressure_sum_max"] == 16e3
    assert run["material"]["body"]["shear_moduli"] == list(design.material.shear_moduli)
    assert run["material"]["thread"]["radius"] == 0.148e-3
    assert run["material"]["core"] == {"young_modulus": 5e6}


def test_without_a_design_the_domain_is_the_papers_and_with_one_it_is_scaled(started, tmp_path):
    _, _, run = started()
    assert run["domain"] == {
        "pressure_max": [60e3, 60e3, 60e3],
        "pressure_sum_max": 110e3,
        "moment_max": 1e-3 * 6.6,
        "torque_max": 1e-3 * 3.3,
    }
    assert run["end_compliance"] == 0.23e-3
    (tmp_path / "run" / "run.json").unlink()
    own = tmp_path / "bare.toml"
    own.write_text(HALF[: HALF.index("[ends]")])
    _, _, run = started("--design", str(own))
    assert run["domain"]["pressure_max"] == [60e3, 60e3, 60e3]
    assert run["domain"]["moment_max"] == pytest.approx(6.6e-3 / 8.0, rel=1e-12)
    assert run["end_compliance"] == pytest.approx(0.46e-3, rel=1e-12)


def test_single_options_change_the_design(started):
    file = str(DESIGNS / "half.toml")
    status, _, run = started("--design", file, "--psi-deg", "30", "--pressure-max-kpa", "50", "40", "30")
    assert status == 3
    changed = parse_design(run["design"])
    assert changed.name == "half, changed"
    assert run["winding"]["pitch"] == changed.winding.pitch == 1.5e-3
    assert run["winding"]["psi"] == pytest.approx(0.5235987755982988, rel=1e-15)
    assert run["domain"]["pressure_max"] == [50e3, 40e3, 30e3]


def test_a_run_of_another_design_is_refused_and_that_of_the_same_resumed(started, tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(HALF)
    assert started("--design", str(file))[0] == 3
    # Comments, and how numbers are written, are no part of a design.
    file.write_text(HALF.replace("body_length_mm = 30", "body_length_mm = 3.0e1 # x"))
    assert started("--design", str(file))[0] == 3
    file.write_text(HALF.replace('bonded = "cap"', 'bonded = "tip"'))
    status, told, _ = started("--design", str(file))
    assert status == 2
    assert told.count("\n") == 1
    assert 'holds a run of another design (bonded = "cap", this one has bonded = "tip")' in told
    file.write_text(HALF.replace("young_modulus_mpa = 5", "young_modulus_mpa = 6"))
    status, told, _ = started("--design", str(file))
    assert status == 2
    assert "(young_modulus_mpa = 5, this one has young_modulus_mpa = 6)" in told


def test_a_run_from_before_designs_is_resumed(started, tmp_path):
    _, _, run = started()
    del run["design"], run["material"]["core"], run["material"]["body"]["stretch_range"]
    (tmp_path / "run" / "run.json").write_text(json.dumps(run))
    assert started()[0] == 3
    status, told, _ = started("--pitch-mm", "4")
    assert status == 2
    assert "holds a run with winding" in told


def test_a_run_of_another_law_is_resumed(started, tmp_path):
    file = tmp_path / "yeoh.toml"
    text = design_text(Design())
    begin, end = text.index('model = "ogden"'), text.index("density_kg_per_m3")
    file.write_text(f'{text[:begin]}model = "yeoh"\nconstants_mpa = [0.05, 0.001]\n{text[end:]}')
    for _ in range(2):
        status, told, run = started("--design", str(file))
        assert status == 3, told
    assert run["material"]["body"]["constants"] == [50e3, 1e3]
    assert "shear_moduli" not in run["material"]["body"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("pitch_mm = 1.5", "pitch_mm = 0.0015", r"winding\.pitch_mm: got 0\.0015, .*; is it in metres\?"),
        ("cap_length_mm = 3", "", r"dimensions\.cap_length_mm: got nothing, expected"),
    ],
)
def test_a_design_that_no_run_can_have_is_refused_in_one_line(old, new, told, tmp_path, capsys):
    file = tmp_path / "own.toml"
    file.write_text(HALF.replace(old, new))
    assert main(["run", "--out", str(tmp_path / "run"), "--design", str(file)]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert re.search(rf"--design.*{told}", line)
    assert not (tmp_path / "run").exists()


def test_there_is_nothing_to_retry_without_a_dataset(capsys, tmp_path):
    status = main(["run", "--retry", "--out", str(tmp_path / "run")])
    assert status == 2
    assert "--retry: got it without --extend" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("seed", ["-1", "1.5", "9" * 30])
def test_a_seed_that_is_none_is_refused_before_anything_is_written(capsys, tmp_path, seed):
    with pytest.raises(SystemExit, match="2"):
        main(["run", "--seed", seed, "--out", str(tmp_path / "run")])
    assert f"--seed: got '{seed}', expected a whole number from 0" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
