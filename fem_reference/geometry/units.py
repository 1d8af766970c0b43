"""Units in which bodies of every size and stiffness are computed alike.

An elastic body has no length and no modulus of its own. Where all lengths of one are λ times, and all moduli
μ times, those of another, it bends by the same angles at μ times the pressures. The lengths and forces of
mesh, contact and solvers must scale along: 0.05 mm between chamber walls is little in a body of 12 mm, and
much in one of 3 mm. They are written once, for one body, and every body is computed in units of its own.

Its millimetre is a twelfth of its outer diameter. Its megapascal is such that its initial shear modulus is
0.10036 of it. In the paper's actuator, for which those lengths and forces were chosen, both are what their
names say. In the finite elements ``mm``, ``MPa`` and ``N`` stand for a body's own, as in this class.
"""

import math
from dataclasses import dataclass

from fem_reference.geometry.dimensions import ActuatorGeometry
from fem_reference.geometry.paper import paper_number, paper_numbers

# Outer diameter in a body's own millimetres, and initial shear modulus in its own megapascals: the paper's.
_DIAMETER = paper_number("dimensions", "body_diameter_mm")
_SHEAR_MODULUS = math.fsum(paper_numbers("material", "shear_moduli_mpa", 6)) / 1e6


@dataclass(frozen=True)
class Units:
    """A body's own millimetre, megapascal and newton; by default those of the SI.

    Parameters
    ----------
    metre : a metre in millimetres.
    megapascal : a megapascal [Pa].
    """

    metre: float = 1e3
    megapascal: float = 1e6

    @classmethod
    def of(cls, geometry: ActuatorGeometry, shear_modulus: float) -> "Units":
        """Return the units of a body with these dimensions and this initial shear modulus [Pa]."""
        stiffness = shear_modulus / (1e6 * _SHEAR_MODULUS)
        return cls(_DIAMETER / geometry.body_diameter, 1e6 * stiffness)

    @property
    def millimetre(self) -> float:
        """A millimetre [m]."""
        return 1.0 / self.metre

    @property
    def newton(self) -> float:
        """A newton [N]: a megapascal on a square millimetre."""
        return self.megapascal / self.metre**2

    @property
    def acceleration(self) -> float:
        """A metre per second squared in millimetres, if masses are the density's in kg/m³ times 1e-12."""
        return 1e12 / (self.megapascal * self.metre)


#: Plain millimetres, megapascals and newtons.
SI = Units()
