"""Tables and keys of a design file: names, kinds, ranges, meanings.

Reader, writer, JSON schema and the reference's page follow this table.
"""

from dataclasses import dataclass
from decimal import Decimal

from fem_reference.design.design import BONDS
from fem_reference.design.kinds import (
    DEGREES,
    KG_PER_M3,
    KPA,
    MM,
    MM_PER_N,
    MPA,
    NONE,
    Flag,
    Number,
    Unit,
    Word,
)
from fem_reference.geometry import COUPLINGS, LAYOUTS, PLAUSIBLE, THREADS
from fem_reference.materials import SILICONES

#: Models of the material.
MODELS = ("ogden", "neo-hookean", "mooney-rivlin", "yeoh")
#: Conventions of an Ogden solid's constants: W = Σ 2μ/α² (…) as in Abaqus, or Σ μ/α (…) as in Ogden (1972).
CONVENTIONS = ("abaqus", "classic")


@dataclass(frozen=True)
class Key:
    """A key of a table.

    Parameters
    ----------
    name : in the file.
    kind : of its value.
    meaning : for people.
    argument : name of what it sets, in `Design` or in its parts.
    optional : whether it may be missing, alone or by what else the table holds.
    """

    name: str
    kind: Number | Word | Flag
    meaning: str
    argument: str
    optional: bool = False


@dataclass(frozen=True)
class Table:
    """A table of the file; the one without a name holds what stands above all tables."""

    name: str
    meaning: str
    keys: tuple[Key, ...]
    optional: bool = False

    def key_of(self, argument: str) -> Key | None:
        """Return the key that sets an argument."""
        return next((key for key in self.keys if key.argument == argument), None)


def _plausible(argument: str, unit: Unit, count: int | None = None) -> Number:
    """Return a number with the range that the argument has in the code."""
    range_ = PLAUSIBLE[argument]
    least, most = (float(Decimal(repr(end)).scaleb(-unit.power)) for end in (range_.least, range_.most))
    return Number(unit, least, most, count)


def _length(argument: str, meaning: str, optional: bool = False) -> Key:
    return Key(f"{argument}_mm", _plausible(argument, MM), meaning, argument, optional)


TABLES: tuple[Table, ...] = (
    Table("", "Above all tables.", (Key("name", Word(), "name of the design", "name"),)),
    Table(
        "dimensions",
        "The body, see `ActuatorGeometry`.",
        (
            _length("body_diameter", "outer diameter of the tube"),
            _length("cavity_diameter", "diameter of the core, and of the cavity that it lies in"),
            _length("outer_wall", "wall between a chamber and the outside"),
            _length("inner_wall", "wall between a chamber and the cavity"),
            _length("partition_wall", "wall between two chambers"),
            _length("body_length", "length of the chambers"),
            _length("cap_length", "length of the solid cap beyond them"),
            _length("winding_diameter", "diameter of the cylinder that the thread's middle lies on"),
            Key(
                "outer_wall_variation",
                Number(NONE, -0.99, 10.0, 3),
                "relative excess of the outer wall at each chamber; 0 by default",
                "outer_wall_variation",
                optional=True,
            ),
        ),
    ),
    Table(
        "material",
        "The silicone: by `name`, by `model` and its constants, or by a `test`.",
        (
            Key("name", Word(tuple(SILICONES)), "a silicone of the library", "name", True),
            Key("test", Word(), "a test's CSV file, beside the design", "test", True),
            Key("model", Word(MODELS), "model of the constants", "model", True),
            Key(
                "convention",
                Word(CONVENTIONS),
                "of Ogden constants: W = Σ 2μ/α² (…) or Σ μ/α (…)",
                "convention",
                True,
            ),
            Key(
                "shear_moduli_mpa",
                Number(MPA, -1e3, 1e3, 0),
                "μ of each Ogden term, or of a neo-Hookean solid",
                "shear_moduli",
                True,
            ),
            Key("exponents", Number(NONE, -100.0, 100.0, 0), "α of each Ogden term", "exponents", True),
            Key(
                "constants_mpa",
                Number(MPA, -1e3, 1e3, 0),
                "C10 and C01 of Mooney–Rivlin, or C1, C2, C3 of Yeoh",
                "constants",
                True,
            ),
            Key(
                "bulk_modulus_mpa",
                _plausible("bulk_modulus", MPA),
                "996 times the shear modulus by default",
                "bulk_modulus",
                True,
            ),
            Key(
                "stretch_range",
                Number(NONE, 0.01, 20.0, 2),
                "smallest and largest stretch that was tested",
                "stretch_range",
                True,
            ),
            Key("source", Word(), "where the constants are from", "material_source", True),
            Key(
                "density_kg_per_m3",
                _plausible("density", KG_PER_M3),
                "of silicone and core; 1070 by default",
                "density",
                True,
            ),
        ),
    ),
    Table(
        "core",
        "The central rod: it keeps its length, and bends as a solid bar that fills the cavity.",
        (Key("young_modulus_mpa", _plausible("young_modulus", MPA), "for bending", "young_modulus"),),
    ),
    Table(
        "thread",
        "By `name`, with a radius of its own if given, or by constants. Not needed without a winding.",
        (
            Key("name", Word(tuple(THREADS)), "a thread of the library", "thread_name", True),
            Key("young_modulus_mpa", _plausible("young_modulus", MPA), "along it", "young_modulus", True),
            _length("radius", "of its section", True),
            Key("coupling", Word(COUPLINGS), "see `Thread`; circumference by default", "coupling", True),
            Key("bends", Flag(), "whether it is a wire, which bends; false by default", "bends", True),
            Key(
                "slack_share",
                Number(NONE, 1e-12, 1.0),
                "stiffness in compression over that in tension; 1 by default, about 1e-4 for yarn",
                "slack_share",
                True,
            ),
        ),
        optional=True,
    ),
    Table(
        "winding",
        "How the thread lies.",
        (
            Key("layout", Word(LAYOUTS), "name of the layout", "layout"),
            Key(
                "psi_deg",
                Number(DEGREES, -360.0, 360.0),
                "azimuth of a crossing of helices, from the middle of chamber 1; 0 by default",
                "psi",
                True,
            ),
            _length("pitch", "advance of helices in a turn", True),
            _length("spacing", "distance from ring to ring", True),
        ),
    ),
    Table(
        "ends",
        "What holds the body's ends.",
        (
            Key(
                "bonded",
                Word(BONDS),
                "where the core is glued in; cap by default",
                "bonded",
                True,
            ),
            Key(
                "cap_wound",
                Flag(),
                "whether the thread covers the cap; false by default",
                "cap_wound",
                True,
            ),
            Key(
                "compliance_mm_per_n",
                _plausible("end_compliance", MM_PER_N),
                "how far the silicone slides along the core at its ends, by the core's pull",
                "end_compliance",
                True,
            ),
        ),
        optional=True,
    ),
    Table(
        "pressures",
        "What the actuator is meant for.",
        (
            Key("largest_kpa", Number(KPA, 1e-3, 1e5, 3), "largest pressure of each chamber", "pressure_max"),
            Key(
                "largest_sum_kpa",
                Number(KPA, 1e-3, 1e5),
                "largest sum of the pressures; that of the three by default",
                "pressure_sum_max",
                True,
            ),
        ),
        optional=True,
    ),
)
