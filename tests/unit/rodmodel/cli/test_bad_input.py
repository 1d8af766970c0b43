"""Bad input: one line that names the argument, what came and what is expected, and status 2."""

from pathlib import Path
from typing import Any

import pytest

from rodmodel.cli import main

GOOD, BAD_INPUT, NO_CONVERGENCE = 0, 2, 3


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("", "got none of them, expected the first two, or the last"),
        ("--bending-angle-deg 30", "got --bending-angle-deg, expected the first two"),
        ("--bending-angle-deg 30 --tip-position-mm 0 0 60", "got --bending-angle-deg and --tip-position-mm"),
        ("--bending-angle-deg -3 --bending-plane-deg 0", "--bending-angle-deg: got '-3', expected one angle"),
        ("--bending-angle-deg 3 --bending-plane-deg x", "--bending-plane-deg: got 'x', expected one finite"),
        ("--tip-position-mm 0 0", "--tip-position-mm: got '0 0', expected three finite components"),
        ("--tip-position-mm 0 0 60 --plot a.png", "--plot a.png"),
        ("--tip-position-mm 0 0 66000", "--tip-position-mm: got '0 0 66000', expected a target within ten"),
        ("--bending-angle-deg 1e9 --bending-plane-deg 0", "--bending-angle-deg: got '1e9', expected at most"),
        ("--bending-angle-deg 1e300 --bending-plane-deg 0", "--bending-angle-deg: got '1e300', expected one"),
    ],
)
def test_bad_targets_are_told_in_one_line(command: Any, arguments: str, said: str) -> None:
    status, out, err = command("inverse", *arguments.split())
    assert (status, out, err.count("\n")) == (BAD_INPUT, "", 1)
    assert said in err


@pytest.mark.parametrize("samples", ["ten", "5", "-400", "1e3", "1_000", "٤٠٠", "9" * 5000, "1000001"])
def test_a_count_of_samples_that_is_none_is_refused(command: Any, samples: str) -> None:
    status, out, err = command("workspace", "--samples", samples)
    assert (status, out, err.count("\n")) == (BAD_INPUT, "", 1)
    assert f"--samples: got '{samples}', expected a whole number from 100 to 1000000" in err


@pytest.fixture(scope="module")
def bad_files(file: Path) -> dict[str, Path]:
    folder = file.parent
    files = {
        "truncated": folder / "truncated.json",
        "other": folder / "other.json",
        "png": folder / "folder.png",
    }
    files["truncated"].write_text(file.read_text()[:500])
    files["other"].write_text(file.read_text().replace("rodmodel-calibration", "something-else"))
    files["png"].mkdir()
    return files


THREE_PRESSURES = "expected three gauge pressures, one for each chamber, each 0 or more [kPa]"

COMPONENTS = "expected three finite components in the world frame"

IN_CAP = "expected three finite components in the frame of the cap"

PLOT_FILE = "expected a .pdf, .png or .svg file in a directory that can be written to"


# Arguments, and what the line must hold: the argument, what came, what is expected.
BAD_INPUTS = [
    ("", "--pressure-kpa: got ''", THREE_PRESSURES),
    ("--pressure-kpa -1 0 0", "--pressure-kpa: got '-1 0 0'", THREE_PRESSURES),
    ("--pressure-kpa -1e-3 0 0", "--pressure-kpa: got '-1e-3 0 0'", THREE_PRESSURES),
    ("--pressure-kpa 1_0 0 0", "--pressure-kpa: got '1_0 0 0'", THREE_PRESSURES),
    ("--pressure-kpa ١٠ 0 0", "--pressure-kpa: got '١٠ 0 0'", THREE_PRESSURES),
    ("--pressure-kpa 1e999 0 0", "--pressure-kpa: got '1e999 0 0'", THREE_PRESSURES),
    ("--pressure-kpa 0x10 0 0", "--pressure-kpa: got '0x10 0 0'", THREE_PRESSURES),
    ("--pressure-kpa nan 0 0", "--pressure-kpa: got 'nan 0 0'", THREE_PRESSURES),
    ("--pressure-kpa -inf 0 0", "--pressure-kpa: got '-inf 0 0'", THREE_PRESSURES),
    ("--pressure-kpa 1 2", "--pressure-kpa: got '1 2'", THREE_PRESSURES),
    ("--pressure-kpa 1 2 3 4", "--pressure-kpa: got '1 2 3 4'", THREE_PRESSURES),
    ("--pressure-kpa 500 0 0", "--pressure-kpa: got '500 0 0'", "at most 70, 60, 60 kPa in chambers 1, 2, 3"),
    ("--pressure-kpa 60 50 0", "--pressure-kpa: got '60 50 0'", "100 kPa in sum"),
    ("{p} --tip-force-n 1 x 0", "--tip-force-n: got '1 x 0'", COMPONENTS),
    ("{p} --tip-moment-nmm 1", "--tip-moment-nmm: got '1'", COMPONENTS),
    ("{p} --gravity 0 0 inf", "--gravity: got '0 0 inf'", COMPONENTS),
    ("{p} --distributed-force-n-per-m 1 2", "--distributed-force-n-per-m: got '1 2'", COMPONENTS),
    ("{p} --follower-force-n 1 2 y", "--follower-force-n: got '1 2 y'", IN_CAP),
    ("{p} --follower-moment-nmm 1 2 nan", "--follower-moment-nmm: got '1 2 nan'", IN_CAP),
    ("{p} --base-position-mm 1", "--base-position-mm: got '1'", COMPONENTS),
    ("{p} --base-rotation-deg 1 2", "--base-rotation-deg: got '1 2'", COMPONENTS),
    ("{p} --base-rotation-deg 0 1e7 0", "--base-rotation-deg: got '0 1e7 0'", "at most 1e+06 deg"),
    ("{p} --base-rotation-deg 0 1e200 0", "--base-rotation-deg: got '0 1e200 0'", COMPONENTS),
    ("--pressure-kpa 1e308 0 0", "--pressure-kpa: got '1e308 0 0'", THREE_PRESSURES),
    ("{p} --base-position-mm 1e308 0 0", "--base-position-mm: got '1e308 0 0'", COMPONENTS),
    ("{p} --psi-deg abc", "--psi-deg: got 'abc'", "expected one finite angle [deg]"),
    (
        "{p} --psi-deg 12",
        "--psi-deg: got '12'",
        "expected double-helix, pitch 3 mm, psi 0 deg and every",
    ),
    ("{p} --pitch-mm 0", "--pitch-mm: got '0'", "expected one positive length [mm]"),
    ("{p} --pitch-mm 4", "--pitch-mm: got '4'", "expected double-helix, pitch 3 mm"),
    ("{p} --layout braid", "--layout: got 'braid'", "expected double-helix"),
    (
        "{p} --calibration {truncated}",
        "{truncated}: got text that is not JSON",
        "expected a whole",
    ),
    ("{p} --calibration {other}", "{other}: schema: got 'something-else'", 'expected "rodmodel-calibration"'),
    ("{p} --calibration /no/such", "--calibration: /no/such: got", "expected a readable calibration file"),
    ("{p} --plot /no/such/a.png", "--plot: got '/no/such/a.png'", PLOT_FILE),
    ("{p} --plot a.xyz", "--plot: got 'a.xyz'", PLOT_FILE),
    ("{p} --plot {png}", "--plot: got '{png}'", PLOT_FILE),
    ("{p} --plot", "argument --plot", "expected one argument"),
    ("{p} --colour red", "--colour red", "see rodmodel --help"),
    ("--press 1 2 3", "--press 1 2 3", "see rodmodel --help"),
]


@pytest.mark.parametrize(("arguments", "came", "expected"), BAD_INPUTS)
def test_bad_input_is_told_in_one_line(
    predict: Any, bad_files: dict[str, Path], arguments: str, came: str, expected: str
) -> None:
    filled = arguments.format(p="--pressure-kpa 30 0 0", **bad_files)
    status, out, err = predict(*filled.split())
    assert (status, out) == (BAD_INPUT, "")
    assert err.startswith("rodmodel: ")
    assert err.count("\n") == 1
    assert came.format(**bad_files) in err
    assert expected in err


@pytest.mark.parametrize("arguments", [[], ["bend"]])
def test_a_command_is_needed(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == BAD_INPUT
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "predict" in err


@pytest.mark.parametrize("picture", ["/proc/a.png", "/tmp/" + 300 * "a" + ".png"])
def test_a_picture_that_cannot_be_written_is_told(predict: Any, picture: str) -> None:
    """A directory that looks as if it took files and does not; a name that is too long."""
    status, out, err = predict("--pressure-kpa", "30", "0", "0", "--plot", picture)
    assert (status, out) == (BAD_INPUT, "")
    assert err.count("\n") == 1
    assert PLOT_FILE in err
