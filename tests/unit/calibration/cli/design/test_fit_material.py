"""The command `rodmodel-design fit-material`: answers, files, and one line for every bad input."""

import json
import tomllib
from pathlib import Path

import pytest

from calibration.cli.design import main

PUBLIC = "Dehnung [%];Spannung [MPa]\n10;0,0111\n50;0,0530\n100;0,1130\n150;0,1906\n200;0,2728\n"


@pytest.fixture
def test(tmp_path) -> Path:
    file = tmp_path / "dragon.csv"
    file.write_text(PUBLIC)
    return file


def test_the_lines_that_are_printed_are_those_that_are_written(test, tmp_path, capsys):
    out, plot = tmp_path / "material.toml", tmp_path / "fit.png"
    assert main(["fit-material", str(test), "--out", str(out), "--plot", str(plot)]) == 0
    printed, said = capsys.readouterr()
    written = out.read_text()
    assert written.startswith("# rodmodel-design fit-material ")
    assert printed.endswith(written.partition("\n")[2])
    table = tomllib.loads(written)["material"]
    assert table["stretch_range"] == [1.0, 3.0]
    assert "dragon.csv" in table["source"]
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert "uniaxial tests alone" in said


def test_json_is_one_object(test, capsys):
    test.write_text(f"{PUBLIC}250;0,3560\n")
    assert main(["fit-material", str(test), "--stretch-max", "3", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["tests"][0]["stretch_range"] == [1.1, 3.0]
    assert record["material"]["model"] == "ogden"


def test_a_fit_in_doubt_ends_with_status_3_and_writes_nothing(test, tmp_path, capsys):
    other, out = tmp_path / "other.csv", tmp_path / "material.toml"
    other.write_text("stretch,stress (MPa)\n1.1,0.3\n1.5,0.6\n2,0.7\n2.5,0.8\n3,0.9\n")
    assert main(["fit-material", str(test), str(other), "--out", str(out)]) == 3
    assert not out.exists()
    assert "the law should not be used" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ([], "FILE: got no test"),
        (["none.csv"], "none.csv: got No such file or directory"),
        (["TEST", "--plot", "fit.txt"], "--plot: got 'fit.txt'"),
        (["TEST", "--out", "/nowhere/material.toml"], "--out: got /nowhere/material.toml"),
        (["TEST", "--stretch-max", "1.2"], "rows up to a stretch of 1.2"),
        (["TEST", "--stretch-max", "0.5"], "--stretch-max: got 0.5, expected more than 1"),
    ],
)
def test_bad_input_ends_with_status_2_and_one_line(test, arguments, named, capsys):
    given = [str(test) if argument == "TEST" else argument for argument in arguments]
    assert main(["fit-material", *given]) == 2
    error = capsys.readouterr().err
    assert named in error
    assert error.count("\n") == 1
