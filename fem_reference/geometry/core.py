"""The central rod, which the field calls the core: it keeps the body's length along the axis."""

import math
from dataclasses import dataclass

from fem_reference.geometry.paper import paper_number
from fem_reference.geometry.plausible import refuse_implausible


@dataclass(frozen=True)
class Core:
    """Inextensible rod in the cavity, with the bending stiffness E π r⁴/4 of a solid round bar.

    It fills the cavity: its diameter is `ActuatorGeometry.cavity_diameter`. The silicone slides on it and
    turns about it without friction.

    Parameters
    ----------
    young_modulus : E of the part that bends [Pa]. The paper's embedded beam fixes only the rod's length; the
        default, that of a soft plastic, is this project's choice for it.

    Raises
    ------
    ValueError
        For a modulus that is not positive and finite, or seems to be in another unit (`plausible`).
    """

    young_modulus: float = paper_number("core", "young_modulus_mpa", 6)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.young_modulus) and self.young_modulus > 0.0):
            raise ValueError(
                f"young_modulus: got {self.young_modulus!r}, expected a positive finite number [Pa]"
            )
        refuse_implausible("young_modulus", self.young_modulus)

    def bending_stiffness(self, diameter: float) -> float:
        """Return E π r⁴/4 [N m²] of a core of that diameter [m]."""
        return self.young_modulus * math.pi * (diameter / 2.0) ** 4 / 4.0
