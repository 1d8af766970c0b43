"""Numbers in another unit are refused by argument, range and unit; the defaults and their like are taken."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fem_reference import (
    Actuator,
    ActuatorGeometry,
    ActuatorLoad,
    DoubleHelix,
    Load,
    MeshLevel,
    Ogden,
    PeriodCell,
    Ring,
    SixHelix,
    Thread,
    layout,
)
from fem_reference.geometry import BULK_TO_SHEAR
from fem_reference.geometry.plausible import PLAUSIBLE
from tests.fem_fixtures import TINY

ROOT = Path(__file__).parents[4]


def pattern(got: str, unit: str) -> str:
    return f"^{re.escape(got)}, expected .*; is it in {re.escape(unit)}\\?$"


@pytest.mark.parametrize(
    ("make", "got", "unit"),
    [
        (lambda: ActuatorGeometry(body_diameter=12.0), "body_diameter: got 12 m", "millimetres"),
        (lambda: ActuatorGeometry(cavity_diameter=2.0), "cavity_diameter: got 2 m", "millimetres"),
        (lambda: ActuatorGeometry(outer_wall=1.0), "outer_wall: got 1 m", "millimetres"),
        (lambda: ActuatorGeometry(inner_wall=1.5), "inner_wall: got 1.5 m", "millimetres"),
        (lambda: ActuatorGeometry(partition_wall=1.6), "partition_wall: got 1.6 m", "millimetres"),
        (lambda: ActuatorGeometry(body_length=60.0), "body_length: got 60 m", "millimetres"),
        (lambda: ActuatorGeometry(cap_length=6.0), "cap_length: got 6 m", "millimetres"),
        (lambda: ActuatorGeometry(winding_diameter=11.2), "winding_diameter: got 11.2 m", "millimetres"),
        # The whole tube in millimetres: consistent in itself.
        (
            lambda: ActuatorGeometry(12.0, 2.0, 1.0, 1.5, 1.6, 60.0, 6.0, 11.2),
            "body_diameter: got 12 m",
            "millimetres",
        ),
        (lambda: Thread(radius=0.0889), "radius: got 0.0889 m", "millimetres"),
        (lambda: Thread(young_modulus=31067.0), "young_modulus: got 31067 Pa", "megapascals"),
        (lambda: DoubleHelix(pitch=3.0), "pitch: got 3 m", "millimetres"),
        (lambda: SixHelix(pitch=3.0), "pitch: got 3 m", "millimetres"),
        (lambda: Ring(1.5), "spacing: got 1.5 m", "millimetres"),
        (lambda: layout("ring", pitch=3.0), "pitch: got 3 m", "millimetres"),
        (lambda: DoubleHelix(psi=30.0), "psi: got 30 rad", "degrees"),
        (lambda: Ogden((0.00681, -0.2881, 0.38165)), "shear_moduli: got 0.10036 Pa", "megapascals"),
        (lambda: Ogden(bulk_modulus=100.0), "bulk_modulus: got 100 Pa", "megapascals"),
        (
            lambda: Ogden((1e4,), (2.0,), 1e11),
            "bulk_modulus: got 1e+11 Pa",
            "another unit, or of another material",
        ),
        (lambda: Actuator(level=TINY, density=1.07), "density: got 1.07 kg/m³", "g/cm³"),
        (lambda: PeriodCell(level=TINY, end_compliance=0.23), "end_compliance: got 0.23 m/N", "mm/N"),
        (lambda: MeshLevel(2, 4, 2, 2, 1, 1, 1, 0.75e-3), "axial_size: got 0.00075 mm", "metres"),
        (lambda: ActuatorLoad(gravity=(0.0, 0.0, -9810.0)), "gravity: got 9810 m/s²", "mm/s²"),
    ],
)
def test_a_number_in_another_unit_is_refused(make: Callable[[], Any], got: str, unit: str) -> None:
    with pytest.raises(ValueError, match=pattern(got, unit)):
        make()


@pytest.mark.parametrize(
    ("load", "got", "unit"),
    [
        (Load((0.0, 0.0, 0.0), moment=(0.0, 3.0, 0.0)), "moment: got 3 N m", "N mm"),
        (Load((0.0, 0.0, 0.0), curvature=(0.0, -1e3, 0.0)), "curvature: got 1000 1/m", "degrees per metre"),
    ],
)
def test_a_load_of_the_cell_in_another_unit_is_refused_before_it_is_followed(
    load: Load, got: str, unit: str
) -> None:
    with pytest.raises(ValueError, match=pattern(got, unit)):
        PeriodCell(level=TINY).solve(load)


@pytest.mark.parametrize(
    ("load", "got", "unit"),
    [
        (ActuatorLoad(tip_force=(0.0, 20.0, 0.0)), "tip_force: got 20 N", "millinewtons"),
        (ActuatorLoad(tip_moment=(2.0, 0.0, 0.0)), "tip_moment: got 2 N m", "N mm"),
    ],
)
def test_a_load_of_the_actuator_in_another_unit_is_refused(load: ActuatorLoad, got: str, unit: str) -> None:
    actuator = Actuator(ActuatorGeometry(body_length=9e-3, cap_length=3e-3), level=TINY)
    with pytest.raises(ValueError, match=pattern(got, unit)):
        actuator.solve(load)


def test_actuators_of_other_sizes_and_materials_are_taken() -> None:
    """A catheter of 3 mm, a gripper's finger, an arm of 12 cm; gel to hard rubber."""
    for scale in (0.25, 1.0, 10.0):
        lengths = {**vars(ActuatorGeometry())}
        variation = lengths.pop("outer_wall_variation")
        scaled = {name: scale * length for name, length in lengths.items()}
        area = ActuatorGeometry(**scaled, outer_wall_variation=variation).chamber_area
        assert area == pytest.approx(scale**2 * ActuatorGeometry().chamber_area)
        assert DoubleHelix(pitch=scale * 3e-3).period == scale * 3e-3
    for modulus in (5e3, 1e5, 3e6):
        assert Ogden((modulus,), (2.0,)).shear_modulus == modulus
    assert Thread(young_modulus=3e6).axial_stiffness > 0.0


def test_a_bulk_modulus_without_bound_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^bulk_modulus: got inf, expected a positive"):
        Ogden(bulk_modulus=float("inf"))


def test_the_bulk_modulus_follows_the_material() -> None:
    """A material of one's own does not come with the paper's bulk modulus."""
    assert Ogden().bulk_modulus == 100e6
    soft = Ogden((20e3,), (2.0,))
    assert soft.bulk_modulus / soft.shear_modulus == pytest.approx(100e6 / 0.10036e6, rel=1e-12)
    assert Ogden((20e3,), (2.0,), 1e9).bulk_modulus == 1e9


def test_the_manual_has_the_ranges() -> None:
    text = (ROOT / "docs" / "reference" / "refused_units.md").read_text()
    for name, range_ in PLAUSIBLE.items():
        assert f"| `{name}` | {range_.least:g} | {range_.most:g} | {range_.unit} |" in text
    assert f"{BULK_TO_SHEAR[0]:g} to {BULK_TO_SHEAR[1]:g} times" in text
