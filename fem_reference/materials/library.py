"""Published silicones by name: constants, tested stretch and source.

Those of the Soft Robotics Materials Database are published as curves of tensile tests. Their constants are
one Ogden term, which is stable at every stretch, fitted up to a stretch of 3 by ``rodmodel-design
fit-material``; docs/reference/silicones.md has the commands.
"""

import difflib
from collections.abc import Mapping
from dataclasses import dataclass

from fem_reference.materials.material import Material
from fem_reference.materials.ogden import Ogden, neo_hookean
from fem_reference.materials.yeoh import Yeoh

_DATABASE = (
    "Marechal, Balland, Lindenroth, Petrou, Kontovounisios, Bello (2021), Towards a common framework and "
    "database of materials for soft robotics, Soft Robotics 8, 284, doi:10.1089/soro.2019.0115"
)
_TESTED = (1.0, 3.0)


@dataclass(frozen=True)
class PublishedSilicone:
    """A silicone and where its constants are from.

    Parameters
    ----------
    name : in design files.
    title : of the product.
    material : law; its `stretch_range` is None where the source does not say what was tested.
    source : publication.
    """

    name: str
    title: str
    material: Material
    source: str


def _from_test(name: str, title: str, modulus: float, exponent: float) -> PublishedSilicone:
    """Return a silicone of the database, as one Ogden term [Pa]."""
    law = Ogden((modulus,), (exponent,), stretch_range=_TESTED)
    return PublishedSilicone(name, title, law, f"{_DATABASE}: test {title!r}")


#: By name.
SILICONES: Mapping[str, PublishedSilicone] = {
    silicone.name: silicone
    for silicone in (
        PublishedSilicone(
            "paper",
            "Dragon Skin 10, the paper's constants",
            Ogden(),
            "Modeling of a two-degree-of-freedom fiber-reinforced soft pneumatic actuator, Robotica (2023), "
            "Table II",
        ),
        _from_test("dragon-skin-10", "Dragon Skin 10 MEDIUM", 40096.8, 3.22707),
        _from_test("dragon-skin-20", "Dragon Skin 20", 110577.0, 3.19725),
        _from_test("dragon-skin-30", "Dragon Skin 30", 168106.0, 2.99815),
        _from_test("ecoflex-00-10", "Ecoflex 00-10", 6739.15, 2.62424),
        _from_test("ecoflex-00-30", "Ecoflex 00-30", 14551.9, 2.33774),
        _from_test("ecoflex-00-50", "Ecoflex 00-50", 19760.7, 2.47082),
        PublishedSilicone(
            "smooth-sil-950",
            "Smooth-Sil 950",
            neo_hookean(0.68e6),
            "Connolly, Polygerinos, Walsh, Bertoldi (2015), Mechanical programming of soft actuators by "
            "varying fiber angle, Soft Robotics 2, 26, doi:10.1089/soro.2015.0001",
        ),
        PublishedSilicone(
            "elastosil-m4601",
            "Elastosil M4601",
            Yeoh((0.11e6, 0.02e6)),
            "Polygerinos, Lyne, Wang, Nicolini, Mosadegh, Whitesides, Walsh (2013), Towards a soft pneumatic "
            "glove for hand rehabilitation, IROS 2013, 1512",
        ),
    )
}


def published_silicone(name: str) -> PublishedSilicone:
    """Return a silicone of the library.

    Raises
    ------
    ValueError
        For an unknown name, with the nearest one.
    """
    if name in SILICONES:
        return SILICONES[name]
    near = difflib.get_close_matches(name.lower(), SILICONES, n=1)
    hint = f"; is it {near[0]}?" if near else ""
    raise ValueError(f"name: got {name!r}, expected one of {', '.join(SILICONES)}{hint}")
