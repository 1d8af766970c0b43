"""One actuator with all that its models take: dimensions, material, core, thread, winding, ends."""

from dataclasses import dataclass, field
from typing import TypedDict

from fem_reference.geometry import (
    ALIKE_LAYOUTS,
    ActuatorGeometry,
    Core,
    DoubleHelix,
    NoWinding,
    Thread,
    Units,
    Winding,
    as_vector,
    refuse_implausible,
)
from fem_reference.materials import Material, Ogden

#: Density of silicone [kg/m³].
DENSITY = 1070.0
#: Where the cavity may be bonded to the core.
BONDS = ("cap", "tip", "all")
# Thinnest wall as a share of the body's diameter: a wall in metres among millimetres is thinner.
_THINNEST = 1.0 / 500.0
# Largest pressure that a design may be meant for, in shear moduli: all known bodies fold far below.
_MOST_PRESSURE = 50.0
_MM, _KPA = 1e3, 1e-3


class Body(TypedDict):
    """Parts of an actuator's body, as `PeriodCell` and `Actuator` take them."""

    geometry: ActuatorGeometry
    winding: Winding
    material: Material
    thread: Thread
    core: Core


@dataclass(frozen=True)
class Design:
    """One actuator: what the cell, the full actuator and a calibration are made from.

    Lengths are in metres, stresses in pascals. A design is read from a file by `read_design`, and written by
    `design_text`. The defaults of the parts are the paper's.

    Parameters
    ----------
    name : one line of text.
    geometry, material, core, thread, winding : the parts.
    density : of silicone and core [kg/m³].
    bonded : where the cavity is bonded to the core, see `Actuator`.
    cap_wound : whether the thread continues over the cap.
    end_compliance : see `PeriodCell` [m/N]; None where it is not known.
    pressure_max, pressure_sum_max : largest pressure of each chamber, and of their sum, that the actuator is
        meant for [Pa]; None where that is left open.
    material_source : where the material's constants are from.

    Raises
    ------
    ValueError
        For parts that do not fit each other: turns of the thread that overlap, a thread that leaves the outer
        wall, a winding longer than the body, a wall much thinner than the body; and for numbers that are out
        of range.
    """

    name: str = "paper"
    geometry: ActuatorGeometry = field(default_factory=ActuatorGeometry)
    material: Material = field(default_factory=Ogden)
    core: Core = field(default_factory=Core)
    thread: Thread = field(default_factory=Thread)
    winding: Winding = field(default_factory=DoubleHelix)
    density: float = DENSITY
    bonded: str = "cap"
    cap_wound: bool = False
    end_compliance: float | None = None
    pressure_max: tuple[float, float, float] | None = None
    pressure_sum_max: float | None = None
    material_source: str = ""

    def __post_init__(self) -> None:
        for name in ("name", "material_source"):
            text = getattr(self, name)
            if not text.isprintable() or (name == "name" and not text.strip()):
                raise ValueError(f"{name}: got {text!r}, expected one line of text")
        refuse_implausible("density", self.density)
        refuse_unknown_bond(self.bonded)
        if self.end_compliance is not None:
            refuse_implausible("end_compliance", self.end_compliance)
        _refuse_thin_walls(self.geometry)
        _refuse_pressures(self)
        if not isinstance(self.winding, NoWinding):
            _refuse_winding(self.geometry, self.winding, self.thread)

    @property
    def body(self) -> Body:
        """The parts that are meshed, by their names as arguments."""
        return Body(
            geometry=self.geometry,
            winding=self.winding,
            material=self.material,
            thread=self.thread,
            core=self.core,
        )

    @property
    def symmetry(self) -> str:
        """Symmetry of the section.

        ``full`` if a turn from one chamber to the next and mirror images take it to itself, ``mirror`` if
        the image in the plane of chamber 1 does, ``none`` otherwise: by the winding and by the outer walls.
        """
        first, second, third = self.geometry.outer_wall_variation
        if not self.winding.mirror_symmetric or second != third:
            return "none"
        return "full" if self.winding.name in ALIKE_LAYOUTS and first == second else "mirror"

    @property
    def mirror_chamber(self) -> int | None:
        """The first chamber, from 1, in whose plane the section is its own mirror image, or None.

        All else goes by that of chamber 1: where it is another, to number that one 1 halves what there is to
        compute.
        """
        walls = self.geometry.outer_wall_variation
        if not self.winding.mirror_symmetric:
            return None
        chambers = (1, 2, 3) if self.winding.name in ALIKE_LAYOUTS else (1,)
        beside = {k: {walls[k % 3], walls[(k + 1) % 3]} for k in chambers}
        return next((k for k in chambers if len(beside[k]) == 1), None)

    @property
    def mirror_in_place(self) -> bool:
        """Whether the body is its own mirror image in chamber 1's plane: half of it then tells the whole.

        A double helix at ψ = 90° is so only after a shift along the axis: its section has the symmetry, and
        no half of a body stands for it.
        """
        return self.winding.mirror_in_place and self.symmetry != "none"

    @property
    def units(self) -> Units:
        """Units in which this body is computed."""
        return Units.of(self.geometry, self.material.shear_modulus)


def refuse_unknown_bond(bonded: str) -> None:
    """Raise a ValueError for a word that is none of `BONDS`."""
    if bonded not in BONDS:
        raise ValueError(f"bonded: got {bonded!r}, expected one of {', '.join(BONDS)}")


def _refuse_thin_walls(geometry: ActuatorGeometry) -> None:
    least = _THINNEST * geometry.body_diameter
    for name in ("outer_wall", "inner_wall", "partition_wall"):
        wall = getattr(geometry, name)
        if wall < least:
            raise ValueError(
                f"{name}: got {_MM * wall:g} mm, expected at least {_MM * least:.3g} mm on a body of "
                f"{_MM * geometry.body_diameter:g} mm; is it in another unit?"
            )


def _refuse_pressures(design: Design) -> None:
    most = _MOST_PRESSURE * design.material.shear_modulus
    each = design.pressure_max
    total = design.pressure_sum_max
    if each is not None:
        as_vector("pressure_max", each, "Pa")
    if (each is None) != (total is None):
        raise ValueError("pressure_max and pressure_sum_max: got one of them, expected both or none")
    for name, values in (
        ("pressure_max", each or ()),
        ("pressure_sum_max", () if total is None else (total,)),
    ):
        for value in values:
            if not 0.0 < value <= most:
                raise ValueError(
                    f"{name}: got {_KPA * value:g} kPa, expected above 0 and at most {_KPA * most:.3g} kPa, "
                    f"{_MOST_PRESSURE:g} shear moduli of the material; is it in another unit?"
                )


def _refuse_winding(geometry: ActuatorGeometry, winding: Winding, thread: Thread) -> None:
    winding.refuse_overlap(thread)
    least = 2.0 * max(geometry.chamber_outer_radii) + thread.diameter
    most = geometry.body_diameter - thread.diameter
    # Rounding of a thread that just touches.
    slack = 1e-9 * geometry.body_diameter
    if not least - slack <= geometry.winding_diameter <= most + slack:
        raise ValueError(
            f"winding_diameter: got {_MM * geometry.winding_diameter:g} mm, expected between "
            f"{_MM * least:.5g} and {_MM * most:.5g} mm: the thread, {_MM * thread.diameter:g} mm thick, "
            "lies within the outer wall"
        )
    if winding.period > geometry.body_length * (1.0 + 1e-9):
        name = "spacing" if hasattr(winding, "spacing") else "pitch"
        raise ValueError(
            f"{name}: got {_MM * getattr(winding, name):g} mm, a winding that repeats after "
            f"{_MM * winding.period:g} mm, expected at most the body's length of "
            f"{_MM * geometry.body_length:g} mm"
        )
