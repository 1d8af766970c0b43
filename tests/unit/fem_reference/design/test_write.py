"""A design that is written and read again is the same one, to the last digit."""

import math
import struct

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fem_reference.design import Design, design_text, parse_design, read_design
from fem_reference.design.kinds import DEGREES, KPA, MM, MPA, number_text
from fem_reference.geometry import ActuatorGeometry, Core, DoubleHelix, NoWinding, Ring, SixHelix, Thread
from fem_reference.materials import Ogden, Yeoh, mooney_rivlin, neo_hookean
from tests.unit.fem_reference.design.schema_file import ROOT

#: Designs that differ from the paper's in every key.
OTHERS = [
    Design(),
    Design('a "b" \\ c', ActuatorGeometry(outer_wall_variation=(0.1, -0.2, 1.0 / 3.0))),
    Design("yeoh", material=Yeoh((0.11e6, 0.02e6)), material_source="a paper, 'p. 3'"),
    Design("range", material=Ogden((4e4,), (3.1,), 3e7, (0.7, 3.0))),
    Design("neo", material=neo_hookean(1e6 / 3.0)),
    Design("mooney", material=mooney_rivlin(0.1e6, 0.02e6)),
    Design("core", core=Core(210e9), density=1234.5, bonded="tip", cap_wound=True),
    Design("thread", thread=Thread(2.7e9 / 7.0, 0.1e-3, "axis", bends=True, slack_share=1e-4)),
    Design("ring", winding=Ring(1.7e-3), end_compliance=0.0),
    Design("six", winding=SixHelix(math.radians(17.3), 4.7e-3), end_compliance=0.23e-3),
    Design("none", winding=NoWinding(), pressure_max=(1e3, 2e3, 1e4 / 3.0), pressure_sum_max=4e3),
]


@pytest.mark.parametrize("design", OTHERS, ids=lambda design: design.name)
def test_what_is_read_again_is_equal(design):
    text = design_text(design)
    again = parse_design(text)
    assert again == design
    assert design_text(again) == text


lengths = st.floats(0.8, 1.2)


@given(
    st.lists(lengths, min_size=6, max_size=6),
    st.floats(-7.0, 7.0),
    st.floats(1e4, 1e6),
    st.floats(-0.2, 0.2),
)
def test_any_numbers_come_back(scales, psi, modulus, variation):
    b, c, o, i, p, length = scales
    geometry = ActuatorGeometry(
        12e-3 * b,
        2e-3 * c,
        1e-3 * o,
        1.5e-3 * i,
        1.6e-3 * p,
        60e-3 * length,
        winding_diameter=12e-3 * b - 0.8e-3 * o,
        outer_wall_variation=(variation, 0.0, 0.0),
    )
    # To degrees within ±360.
    assume(abs(psi) < 2.0 * math.pi)
    try:
        design = Design("any", geometry, neo_hookean(modulus), winding=DoubleHelix(psi))
    except ValueError:
        assume(False)
    assume("radians" not in _complaint(design))
    assert parse_design(design_text(design)) == design


def _complaint(design):
    try:
        parse_design(design_text(design))
    except ValueError as error:
        return str(error)
    return ""


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_units_are_turned_exactly(value):
    for unit in (MM, MPA, KPA):
        text = unit.from_si(value)
        assume(-300 < math.log10(abs(value) or 1.0) < 300)
        assert unit.to_si(text) == value


@given(st.floats(-10.0, 10.0))
def test_degrees_come_back_to_the_last_bit(psi):
    assert struct.pack("d", DEGREES.to_si(DEGREES.from_si(psi)) + 0.0) == struct.pack("d", psi + 0.0)


@pytest.mark.parametrize("degrees", [0.0, 15.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0, -37.5, 12.34])
def test_degrees_are_those_of_math_radians(degrees):
    """To the last digit but one: those are rounded twice."""
    from decimal import Decimal

    assert DEGREES.to_si(Decimal(repr(degrees))) == pytest.approx(math.radians(degrees), rel=3e-16, abs=0.0)
    assert number_text(DEGREES.from_si(DEGREES.to_si(Decimal(repr(degrees))))) == f"{degrees:g}"


def test_the_papers_design_is_that_of_the_classes():
    """The file is where people look; until the classes have no defaults, the two must agree."""
    paper = read_design(ROOT / "designs" / "paper.toml")
    assert paper == Design(
        end_compliance=0.23e-3,
        pressure_max=(60e3, 60e3, 60e3),
        pressure_sum_max=110e3,
        material_source=paper.material_source,
    )


def test_the_text_begins_with_a_name_and_not_with_a_bracket():
    """Attributes of datasets take what begins with a bracket for JSON."""
    assert design_text(Design()).startswith('name = "paper"\n')
