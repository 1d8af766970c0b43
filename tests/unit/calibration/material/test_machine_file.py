"""Files of test machines: units, separators, preambles; what is taken, left out and refused."""

from pathlib import Path

import numpy as np
import pytest

from calibration.material import MaterialTestError, Specimen, read_material_test
from calibration.material.columns import column

STRETCH = np.array([1.1, 1.5, 2.0, 2.5, 3.0])
STRESS = np.array([11100.0, 53000.0, 113000.0, 190600.0, 272800.0])


def written(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    file = folder / "test.csv"
    file.write_bytes(text.encode(encoding))
    return file


def lines(*columns: np.ndarray, separator: str = ",", comma: bool = False) -> str:
    rows = [separator.join(f"{value:.6f}" for value in row) for row in np.stack(columns, axis=1)]
    return "\n".join(row.replace(".", ",") if comma else row for row in rows) + "\n"


@pytest.mark.parametrize(
    ("name", "below", "quantity", "unit"),
    [
        ("Engineering Stress (MPa)", "", "stress", "mpa"),
        ("True Strain", "", "true strain", ""),
        ("wahre Spannung [kPa]", "", "true stress", "kpa"),
        ("Dehnung / %", "", "strain", "%"),
        ("Extension", "(mm)", "displacement", "mm"),
        ("Extension [%]", "", "strain", "%"),
        ("Dehnung", "mm", "displacement", "mm"),
        ("nominal_stress_psi", "", "stress", "psi"),
        ("Standardkraft in N", "", "force", "n"),
        ("σ [N/mm²]", "", "stress", "n/mm²"),
        ("λ", "", "stretch", ""),
        ("Stretch ratio", "", "stretch", ""),
        ("strain_percent", "", "strain", "percent"),
    ],
)
def test_a_column_is_known_by_the_names_that_machines_give_it(name, below, quantity, unit):
    found = column(name, below)
    assert found is not None
    assert (found.quantity, found.unit) == (quantity, unit)
    assert found.scale is not None


@pytest.mark.parametrize(
    "name", ["Time (s)", "Strain rate (1/s)", "Querdehnung [%]", "Maximum stress (MPa)", "Width"]
)
def test_a_column_of_something_else_is_passed_over(name):
    assert column(name) is None


@pytest.mark.parametrize(
    "text",
    [
        "stretch,stress (MPa)\n" + lines(STRETCH, STRESS / 1e6),
        "strain [%],nominal stress [kPa]\n" + lines(100.0 * (STRETCH - 1.0), STRESS / 1e3),
        "Dehnung [%];Spannung [N/mm²]\n"
        + lines(100.0 * (STRETCH - 1.0), STRESS / 1e6, separator=";", comma=True),
        "Strain\tStress\n(mm/mm)\t(psi)\n" + lines(STRETCH - 1.0, STRESS / 6894.757293168, separator="\t"),
        # True ones alone, and beside nominal ones, which are taken.
        "true strain,true stress (kPa)\n" + lines(np.log(STRETCH), STRESS * STRETCH / 1e3),
        "true strain,true stress (kPa),stretch,stress (Pa)\n"
        + lines(np.zeros(5), np.zeros(5), STRETCH, STRESS),
        "Kraft (N),Weg (mm)\n" + lines(18e-6 * STRESS, 33.0 * (STRETCH - 1.0)),
        # As the Soft Robotics Materials Database has them.
        "PARAMETER;INFO;URL;;\nSpecimen Width (mm);6;;;\nLoad Cell;1 kN;;;\n"
        "Strain calculation;Derived from the machine crosshead;;;\n;;;;\n"
        "Time (s);True Strain;Engineering Strain;Engineering Stress (MPa)\n"
        + lines(STRETCH, np.log(STRETCH), STRETCH - 1.0, STRESS / 1e6, separator=";"),
    ],
    ids=["plain", "percent", "German", "units below", "true", "both", "force", "database"],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_the_same_test_is_read_from_every_form_of_its_file(tmp_path, text, encoding):
    specimen = Specimen(33e-3, 18e-6)
    found = read_material_test(written(tmp_path, text, encoding), "uniaxial", specimen)
    np.testing.assert_allclose(found.stretch, STRETCH, rtol=1e-5)
    np.testing.assert_allclose(found.stress, STRESS, rtol=2e-4)
    assert found.passed_over == ()


def test_unloading_and_what_follows_the_break_are_left_out(tmp_path):
    stretch, stress = np.array([1.5, 2.0, 2.5, 2.0, 1.5]), np.array([5.0, 10.0, 16.0, 8.0, 3.0])
    found = read_material_test(written(tmp_path, "stretch,stress (kPa)\n" + lines(stretch, stress)))
    assert found.stretch.tolist() == [1.5, 2.0, 2.5]
    assert found.passed_over == ("2 rows after line 4, where the strain goes back",)
    broken = written(
        tmp_path, "stretch,stress (kPa)\n" + lines(np.linspace(1.5, 3.5, 5), np.array([5, 10, 16, 0, 0]))
    )
    found = read_material_test(broken)
    assert found.stretch.tolist() == [1.5, 2.0, 2.5]
    assert found.passed_over == ("2 rows after line 4, where the specimen breaks",)


def test_rows_up_to_a_stretch_are_those(tmp_path):
    found = read_material_test(written(tmp_path, "stretch,stress (Pa)\n" + lines(STRETCH, STRESS)))
    assert found.up_to(2.5).stretch.tolist() == [1.1, 1.5, 2.0, 2.5]
    with pytest.raises(MaterialTestError, match=r"test.csv: got 1 rows up to a stretch of 1.2"):
        found.up_to(1.2)


GOOD = lines(STRETCH, STRESS)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "line 1: got no line of names"),
        (GOOD, "line 1: got no line of names"),
        ("stretch,stress\n" + GOOD, "line 1: stress: got no unit, expected one of pa, kpa, mpa, psi"),
        ("stretch,stress (bar)\n" + GOOD, "stress \\(bar\\): got the unit 'bar'"),
        ("stretch,stress (Pa),stress 2 (Pa)\n" + lines(STRETCH, STRESS, STRESS), "expected one stress"),
        ("stretch,force (N)\n" + GOOD, "got forces, expected --area-mm2 too"),
        ("extension (mm),stress (Pa)\n" + GOOD, "got displacements, expected --gauge-length-mm too"),
        ("stretch,stress (Pa)\n1.1,x\n" + GOOD, "line 2: stress \\(Pa\\): got 'x', expected a finite number"),
        ("stretch,stress (Pa)\n1.1,11\n", "got 1 rows of numbers, expected at least 3"),
        ("strain,stress (Pa)\n" + lines(100.0 * (STRETCH - 1.0), STRESS), "is it in %\\?"),
        ("strain,stress (Pa)\n" + lines(0.001 * STRETCH, STRESS), "expected a strain of at least 2 %"),
        ("stretch,stress (Pa)\n" + lines(STRETCH - 1.0, STRESS), "is the column a strain\\?"),
        ("stretch,stress (Pa)\n" + lines(STRETCH, -STRESS), "got stresses against the strain"),
    ],
)
def test_a_faulty_file_is_refused_in_one_line_that_says_where(tmp_path, text, named):
    file = written(tmp_path, text)
    with pytest.raises(MaterialTestError, match=named) as error:
        read_material_test(file)
    assert str(error.value).startswith(f"{file}: line ")
    assert "\n" not in str(error.value)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(MaterialTestError, match="expected a readable CSV file"):
        read_material_test(tmp_path / "none.csv")
