"""The file of measurements: what is read, and one line for each thing that can be wrong with it."""

import numpy as np
import pytest

from calibration.cli import main
from calibration.measured import MeasuredError, read_measured
from rodmodel import Domain

DOMAIN = Domain((60e3, 48e3, 48e3), 64e3, 1.5e-3)
NAMES = "pressure_1_kpa,pressure_2_kpa,pressure_3_kpa,bending_angle_deg,tip_x_mm"
GOOD = "10,0,0,12,-3"


def test_columns_come_in_si_in_any_order_with_loads_and_the_lines_they_were_on(tmp_path):
    file = tmp_path / "data.csv"
    file.write_text(
        "\ufeff# bench 2\n"
        "tip_x_mm,pressure_3_kpa,pressure_1_kpa,pressure_2_kpa,bending_angle_deg,"
        "gravity_x_m_per_s2,gravity_y_m_per_s2,gravity_z_m_per_s2\n"
        "-3, 3, 1, 2, 180, 0, 0, -9.81\n"
        "\n"
        "-4, 0, 20, 0, 90, 0, 0, -9.81\n",
        encoding="utf-8",
    )
    measured = read_measured(file, DOMAIN)
    assert measured.outputs == ("bending_angle_deg", "tip_x_mm")
    np.testing.assert_allclose(measured.pressure, [[1e3, 2e3, 3e3], [20e3, 0, 0]], rtol=1e-15)
    np.testing.assert_allclose(measured.values, [[np.pi, -3e-3], [np.pi / 2, -4e-3]], rtol=1e-15)
    assert measured.tip_force is None
    np.testing.assert_array_equal(measured.gravity, [[0, 0, -9.81]] * 2)
    assert measured.lines == (3, 5)


@pytest.mark.parametrize(
    ("text", "line", "came", "expected"),
    [
        ("", 1, "empty file", "names of columns"),
        (NAMES, 2, "no measurement", "one on each line"),
        (f"{NAMES.replace('pressure_2_kpa,', '')}\n10,0,12,-3", 1, "'pressure_2_kpa'", "pressure_1_kpa"),
        (f"{NAMES.replace('_mm', '_m')}\n{GOOD}", 1, "'tip_x_m'", "tip_x_mm"),
        (f"{NAMES},tip_x_mm\n{GOOD},1", 1, "2 columns 'tip_x_mm'", "one"),
        (f"{NAMES},tip_force_x_n\n{GOOD},1", 1, "'tip_force_y_n'", "all of"),
        ("pressure_1_kpa,pressure_2_kpa,pressure_3_kpa\n1,2,3", 1, "no measured column", "bending_angle_deg"),
        (f"{NAMES}\n{GOOD}\n10,0,0,twelve,-3", 3, "'twelve'", "positive number"),
        (f"{NAMES}\n{GOOD}\n10,0,0,12,nan", 3, "'nan'", "a finite number"),
        (f"{NAMES}\n\n10,0,0,12,", 3, "''", "a finite number"),
        (f"{NAMES}\n10,-1,0,12,-3", 2, "'-1'", "zero or a positive number"),
        (f"{NAMES}\n10,0,0,-12,-3", 2, "'-12'", "zero or a positive number"),
        (f"{NAMES}\n{GOOD}\n61,0,0,12,-3", 3, "61 0 0 kPa", "at most 60, 48, 48 kPa"),
        (f"{NAMES}\n30,30,10,12,-3", 2, "30 30 10 kPa", "64 kPa in sum"),
        (f"{NAMES}\n10,0,0,12", 2, "4 values", "5"),
    ],
)
def test_what_is_wrong_is_said_in_one_line_with_its_number(tmp_path, text, line, came, expected):
    file = tmp_path / "data.csv"
    file.write_text(text)
    with pytest.raises(MeasuredError) as raised:
        read_measured(file, DOMAIN)
    message = str(raised.value)
    assert message.startswith(f"{file}: line {line}: ")
    assert came in message
    assert expected in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ([], ("data.csv", "line 2", "tip_x_mm", "'x'", "finite")),
        (["--layout", "knot"], ("--layout", "knot", "double-helix")),
        (["--angle-noise-deg", "0"], ("--angle-noise-deg", "'0'", "positive")),
    ],
)
def test_the_command_ends_with_2_and_one_line(tmp_path, capsys, arguments, parts):
    file = tmp_path / "data.csv"
    file.write_text(f"{NAMES}\n10,0,0,12,x\n")
    try:
        status = main(["fit-measured", str(file), *arguments])
    except SystemExit as ended:
        status = ended.code
    printed = capsys.readouterr()
    assert status == 2
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    for part in parts:
        assert part in printed.err


def test_a_missing_file_is_said_in_one_line(tmp_path):
    with pytest.raises(MeasuredError, match=r"none\.csv: got No such file or directory, expected"):
        read_measured(tmp_path / "none.csv", DOMAIN)
