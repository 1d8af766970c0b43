"""The file of measurements: what is read, and one line for each thing that can be wrong with it."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.cli import main
from calibration.measured import MeasuredError, read_measured
from calibration.measured.states import states_of
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
        (f"{NAMES.replace('_mm', '_m')}\n{GOOD}", 1, "an unknown column 'tip_x_m'", "tip_x_mm"),
        (f"{NAMES},\n{GOOD},7", 1, "a column without a name", "--lenient"),
        (GOOD, 1, "numbers and no line of names", "pressure_1_kpa"),
        (f"{NAMES}\n10,5,0,0,12,-3,1", 2, "7 values", "decimal commas need semicolons"),
        (f"{NAMES},tip_x_mm\n{GOOD},1", 1, "2 columns 'tip_x_mm'", "one"),
        (f"{NAMES},tip_force_x_n\n{GOOD},1", 1, "'tip_force_y_n'", "all of"),
        ("pressure_1_kpa,pressure_2_kpa,pressure_3_kpa\n1,2,3", 1, "no measured column", "bending_angle_deg"),
        (f"{NAMES}\n{GOOD}\n10,0,0,twelve,-3", 3, "'twelve'", "positive number"),
        (f"{NAMES}\n{GOOD}\n10,0,0,12,nan", 3, "'nan'", "a finite number"),
        (f"{NAMES}\n\n10,0,0,12,", 3, "tip_x_mm: got an empty cell", "--lenient passes over its line"),
        (f"{NAMES}\n10,-1,0,12,-3", 2, "'-1'", "zero or a positive number"),
        (f"{NAMES}\n10,0,0,-12,-3", 2, "'-12'", "zero or a positive number"),
        (f"{NAMES}\n{GOOD}\n61,0,0,12,-3", 3, "61 0 0 kPa", "at most 60, 48, 48 kPa"),
        (f"{NAMES}\n30,30,10,12,-3", 2, "30 30 10 kPa", "64 kPa in sum"),
        (f"{NAMES}\n100,0,0,2,-3\n400,0,0,12,-3", 2, "100 0 0 kPa", "mbar, which are 0.1 kPa?"),
        (f"{NAMES}\n8000,0,0,2,-3\n40000,0,0,12,-3", 2, "8000 0 0 kPa", "Pa, which are 0.001 kPa?"),
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


def test_the_limit_beside_is_told_where_it_is_passed(tmp_path):
    file = tmp_path / "data.csv"
    file.write_text(f"{NAMES}\n40,20,0,12,-3")
    read_measured(file, DOMAIN)
    with pytest.raises(MeasuredError, match=r"got 40 20 0 kPa, .* and 45 kPa in each with 0\.5 of the two"):
        read_measured(file, replace(DOMAIN, beside_share=0.5, beside_max=45e3))


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


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("separator", [";", "\t"])
def test_what_spreadsheets_write_is_read(tmp_path, separator, encoding):
    rows = [
        NAMES.split(","),
        ["1,5", "0", "20,25", "12,125", "-3,5e0"],
        ["", "", "", "", ""],
        GOOD.split(","),
    ]
    # Two empty columns are appended.
    lines = [separator.join([*row, "", ""]) for row in rows]
    file = tmp_path / "data.csv"
    file.write_bytes("\r\n".join(["# Prüfstand 2", *lines, ""]).encode(encoding))
    measured = read_measured(file, DOMAIN)
    np.testing.assert_allclose(measured.pressure, [[1.5e3, 0, 20.25e3], [10e3, 0, 0]], rtol=1e-15)
    np.testing.assert_allclose(np.degrees(measured.values[:, 0]), [12.125, 12.0], rtol=1e-15)
    np.testing.assert_allclose(measured.values[:, 1], [-3.5e-3, -3e-3], rtol=1e-15)
    assert measured.lines == (3, 5)
    assert measured.passed_over == ()


def test_the_separator_that_excel_names_in_the_first_line_is_taken(tmp_path):
    file = tmp_path / "data.csv"
    file.write_text(f"sep=;\n{NAMES.replace(',', ';')}\n{GOOD.replace(',', ';')}\n")
    assert read_measured(file, DOMAIN).lines == (3,)


def test_a_workbook_is_no_csv_file(tmp_path):
    file = tmp_path / "data.csv"
    file.write_bytes(b"PK\x03\x04rest")
    with pytest.raises(MeasuredError, match="got a workbook, expected a CSV file: save the sheet as one"):
        read_measured(file, DOMAIN)


def test_unknown_columns_and_rows_with_an_empty_cell_are_passed_over_where_asked(tmp_path):
    file = tmp_path / "data.csv"
    file.write_text(
        f"{NAMES},remark,{NAMES[:5]}\n{GOOD},first,1\n20,0,0,,-5,second,2\n30,0,0,40,-9,third,3\n"
    )
    with pytest.raises(MeasuredError, match="an unknown column 'remark'"):
        read_measured(file, DOMAIN)
    measured = read_measured(file, DOMAIN, lenient=True)
    np.testing.assert_allclose(measured.pressure[:, 0], [10e3, 30e3])
    assert measured.outputs == ("bending_angle_deg", "tip_x_mm")
    assert measured.passed_over == ("column 'remark'", "column 'press'", "line 3, bending_angle_deg empty")
    file.write_text(f"{NAMES}\n20,0,0,,-5\n")
    with pytest.raises(MeasuredError, match="got no measurement"):
        read_measured(file, DOMAIN, lenient=True)


def test_columns_without_names_are_those_of_the_template_where_asked(tmp_path):
    file = tmp_path / "data.csv"
    file.write_text("10,0,0,12,180\n20,0,0,25,180\n")
    with pytest.raises(
        MeasuredError, match=r"line 1: got numbers and no line of names .* --lenient takes 4, 5, 8"
    ):
        read_measured(file, DOMAIN)
    measured = read_measured(file, DOMAIN, lenient=True)
    assert measured.outputs == ("bending_angle_deg", "bending_plane_deg")
    np.testing.assert_allclose(measured.pressure[:, 0], [10e3, 20e3])
    assert measured.lines == (1, 2)
    assert "missing names" in measured.passed_over[0]
    file.write_text("10,0,0,12,180,1\n")
    with pytest.raises(MeasuredError, match="got numbers and no line of names"):
        read_measured(file, DOMAIN, lenient=True)


def test_repeats_of_a_state_are_one_row_and_their_scatter(tmp_path):
    file = tmp_path / "data.csv"
    planes = NAMES.replace("tip_x_mm", "bending_plane_deg")
    file.write_text(f"{planes}\n10,0,0,12,359\n20,0,0,30,180\n10.02,0,0,14,1\n9.98,0,0,13,0\n")
    repeats = states_of(read_measured(file, DOMAIN))
    assert repeats.rows == 4
    assert repeats.measured.lines == (2, 3)
    np.testing.assert_allclose(repeats.measured.pressure[:, 0], [10e3, 20e3])
    # Of 12, 14, 13 and 359, 361, 360: a standard deviation of 1 each, two degrees of freedom.
    np.testing.assert_allclose(
        np.degrees(repeats.measured.values[0]) % 360.0 % 359.9999, [13.0, 0.0], atol=1e-3
    )
    np.testing.assert_allclose(np.degrees(repeats.scatter), [1.0, 1.0], rtol=1e-9)


def test_other_loads_are_other_states(tmp_path):
    file = tmp_path / "data.csv"
    forces = ",tip_force_x_n,tip_force_y_n,tip_force_z_n"
    file.write_text(f"{NAMES}{forces}\n{GOOD},0,0,0\n{GOOD},0.01,0,0\n")
    repeats = states_of(read_measured(file, DOMAIN))
    assert len(repeats.measured.lines) == 2
    assert np.all(np.isnan(repeats.scatter))


def test_a_missing_file_is_said_in_one_line(tmp_path):
    with pytest.raises(MeasuredError, match=r"none\.csv: got No such file or directory, expected"):
        read_measured(tmp_path / "none.csv", DOMAIN)
