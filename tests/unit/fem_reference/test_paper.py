"""The paper's actuator stands in its design file alone; the defaults of all parts are exactly its numbers."""

import tokenize

import pytest

from fem_reference import Design, read_design
from fem_reference.geometry import SI, Units, paper_number, paper_numbers
from tests.unit.fem_reference.design.schema_file import ROOT

# Forms that code would have them in. Numbers that mean much else, such as 1e-3 and 0.06, are left out.
LENGTHS = {"12e-3", "60e-3", "11.2e-3", "1.6e-3", "0.0889e-3", "0.0889", "8.89e-5", "0.012", "0.0112"}
MODULI = {"0.00681", "0.2881", "0.38165", "0.00681e6", "0.2881e6", "0.38165e6", "9.33", "3.376", "2.487"}
OTHERS = {"0.10036", "0.23", "0.23e-3", "110e-3", "110e3", "55e3", "54e3"}
FORBIDDEN = LENGTHS | MODULI | OTHERS


def test_the_defaults_are_those_of_the_file():
    """To the last bit: other bodies are computed in units of this one."""
    read = read_design(ROOT / "designs" / "paper.toml")
    own = Design()
    for part in ("geometry", "core", "thread", "winding", "density"):
        assert getattr(read, part) == getattr(own, part)
    assert read.material.shear_moduli == own.material.shear_moduli == (6810.0, -288100.0, 381650.0)
    assert own.geometry.winding_diameter == 0.0112
    assert own.thread.radius == 0.0889e-3
    assert Units.of(own.geometry, own.material.shear_modulus) == SI


def test_a_number_is_the_nearest_to_its_decimal_digits():
    assert paper_number("ends", "compliance_mm_per_n", -3) == 0.23e-3
    assert paper_numbers("pressures", "largest_kpa", 3) == (60e3,) * 3
    with pytest.raises(ValueError, match="too many values"):
        paper_number("pressures", "largest_kpa")


@pytest.mark.parametrize("package", ["fem_reference", "calibration"])
def test_no_code_has_the_papers_numbers(package):
    found = []
    for file in sorted((ROOT / package).rglob("*.py")):
        with tokenize.open(file) as text:
            numbers = [t for t in tokenize.generate_tokens(text.readline) if t.type == tokenize.NUMBER]
        found += [
            f"{file.relative_to(ROOT)}:{t.start[0]}: {t.string}" for t in numbers if t.string in FORBIDDEN
        ]
    assert found == []
