"""Units of a body: plain ones for the paper's, and of one kind with each other."""

import pytest

from fem_reference import Actuator, ActuatorGeometry, ActuatorLoad, Load, Ogden, PeriodCell
from fem_reference.design import Design
from fem_reference.geometry import SI, Units
from tests.fem_fixtures import TINY
from tests.similar_designs import scaled


def test_the_papers_actuator_is_computed_in_plain_millimetres_and_megapascals():
    """To the last bit, so that its results stay as they are."""
    assert Units.of(ActuatorGeometry(), Ogden().shear_modulus) == SI
    assert (SI.newton, SI.millimetre, SI.acceleration) == (1.0, 1e-3, 1e3)


def test_similar_bodies_have_similar_units():
    found = scaled(Design(), 3.0, 0.25).units
    assert found.millimetre == pytest.approx(3e-3, rel=1e-15)
    assert found.megapascal == pytest.approx(0.25e6, rel=1e-15)
    assert found.newton == pytest.approx(0.25 * 9.0, rel=1e-15)
    # A tonne of the density's and an acceleration make a force, in newtons of the body.
    density, volume, gravity = 1070.0, 2e-6, 9.81
    weight = 1e-12 * density * volume * found.metre**3 * gravity * found.acceleration
    assert weight * found.newton == pytest.approx(density * volume * gravity, rel=1e-14)


@pytest.mark.parametrize("modulus", [1.0, 0.25])
def test_a_pressure_in_another_unit_is_refused_by_the_materials_stiffness(modulus):
    body = scaled(Design(), 1.0, modulus)
    most = 4.0 * modulus * 100.36e3
    cell = PeriodCell.of(body, TINY)
    cell.refuse(Load((most, 0.0, 0.0)))
    told = r"^pressure: got .* expected each between 0 and .* Pa, 4 shear moduli of the material; is it in"
    with pytest.raises(ValueError, match=told):
        cell.refuse(Load((0.0, 1.01 * most, 0.0)))
    with pytest.raises(ValueError, match=told):
        Actuator.of(body, TINY).refuse(ActuatorLoad((0.0, 0.0, 1.01 * most)))
