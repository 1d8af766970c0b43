"""Numbers in another unit are refused by name; those of real and of model rods are taken."""

import dataclasses
import re
from pathlib import Path

import jax
import jax.numpy as jnp
import pytest

import rodmodel
import rodmodel.statics  # makes the actuator known to JAX
from rodmodel import Actuator, Layout
from rodmodel.actuator import PLAUSIBLE
from tests.unit.rodmodel.calibrations import ACTUATOR

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("body_length", 60.0, "body_length: got 60 m, expected 0.0001 to 10 m; is it in millimetres?"),
        ("body_length", 60, "body_length: got 60 m"),
        ("cap_length", 6.0, "cap_length: got 6 m, expected 0 to 2 m; is it in millimetres?"),
        ("body_diameter", 12.0, "body_diameter: got 12 m, expected 1e-06 to 2 m; is it in millimetres?"),
        ("stiff_tip", 2.2, "stiff_tip: got 2.2 m"),
        ("tip_offset", 2.5, "tip_offset: got 2.5 m"),
        ("tip_draw", 700.0, "tip_draw: got 700 m³, expected -10 to 10 m³; is it in cubic millimetres?"),
        ("base_turn", 2.2, "base_turn: got 2.2 rad/Pa, expected -0.01 to 0.01 rad/Pa; is it per kilopascal?"),
        (
            "mass_per_length",
            70.0,
            "mass_per_length: got 70 kg/m, expected at most 3.39 kg/m for a body of 12 mm",
        ),
        ("cap_mass", 0.73, "cap_mass: got 0.73 kg, expected at most 0.224 kg for a body of 12 mm diameter"),
        ("body_length", -0.06, "body_length: got -0.06 m, expected 0.0001 to 10 m"),
        ("cap_mass", float("nan"), "cap_mass: got nan kg"),
        ("body_diameter", float("inf"), "body_diameter: got inf m"),
    ],
)
def test_a_number_in_another_unit_is_refused_by_name(name: str, value: float, told: str) -> None:
    with pytest.raises(ValueError, match="^" + re.escape(told)):
        dataclasses.replace(ACTUATOR, **{name: value})


def test_rods_without_units_are_taken() -> None:
    assert Actuator(1.0, 0.0, 0.1, 0.0, 0.0).bending_length == 1.0
    assert Actuator(1, 0, 0.1, 0, 0).tip_length == 0


def test_arrays_and_derivatives_are_taken_as_they_are() -> None:
    """A derivative by a length is no length."""

    def end(actuator: Actuator) -> jax.Array:
        return jnp.asarray(1e3 * actuator.bending_length)

    rod = jax.tree.map(jnp.asarray, ACTUATOR)
    by = jax.jit(jax.grad(end))(rod)
    assert (float(by.body_length), float(by.stiff_tip)) == (1e3, -1e3)
    marks = jax.tree.map(lambda leaf: True, rod)
    assert marks.body_length is True


def test_a_pitch_in_millimetres_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^pitch: got 3 m, expected 1e-06 to 1 m; is it in millimetres\?"):
        Layout("double-helix", 0.0, 3.0)


def test_every_shipped_actuator_is_plausible_and_the_manual_has_the_ranges() -> None:
    assert len(rodmodel.shipped_calibrations()) > 1
    text = (ROOT / "docs" / "reference" / "refused_units.md").read_text()
    for name, (least, most, unit, _) in PLAUSIBLE.items():
        assert f"| `{name}` | {least:g} | {most:g} | {unit} |" in text
