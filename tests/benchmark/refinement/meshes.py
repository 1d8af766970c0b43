"""Windings and nested meshes of the refinement study.

A mesh is a section and a number of layers in a period. Of linear hexahedra there are the coarse section
and one with twice its counts; of quadratic ones too. Layers double. So each of the two families has a mesh
that is twice as fine in every direction, or tells both directions apart.
"""

import math
from dataclasses import dataclass, replace

from fem_reference import LEVELS, DoubleHelix, MeshLevel, Ring, SixHelix, Winding

SECTIONS = {
    "linear": MeshLevel(4, 12, 4, 4, 2, 2, 1, 1.0),
    "linear-2": MeshLevel(8, 24, 8, 8, 4, 4, 2, 1.0),
    "quadratic": MeshLevel(2, 8, 2, 2, 1, 1, 1, 1.0, order=2),
    "quadratic-2": MeshLevel(4, 16, 4, 4, 2, 2, 2, 1.0, order=2),
}


@dataclass(frozen=True)
class Case:
    """A winding, and the layers in its period of the coarsest linear and quadratic mesh.

    The coarsest quadratic mesh has an element from one crossing of threads to the middle between two, or from
    a ring to the middle between two, and none longer than 1 mm.
    """

    winding: Winding
    linear: int
    quadratic: int


WINDINGS: dict[str, Case] = {
    "psi 90": Case(DoubleHelix(psi=math.pi / 2), 6, 4),
    "rings": Case(Ring(), 4, 2),
    "six helices": Case(SixHelix(), 4, 4),
    "pitch 4": Case(DoubleHelix(pitch=4e-3), 8, 4),
    "psi 0": Case(DoubleHelix(), 6, 4),
    "psi 45": Case(DoubleHelix(psi=math.pi / 4), 6, 4),
    "pitch 2": Case(DoubleHelix(pitch=2e-3), 4, 4),
    "pitch 6": Case(DoubleHelix(pitch=6e-3), 12, 6),
    "psi 60": Case(DoubleHelix(psi=math.pi / 3), 6, 4),
    "psi 30": Case(DoubleHelix(psi=math.pi / 6), 6, 4),
    "psi 12": Case(DoubleHelix(psi=math.radians(12.0)), 6, 4),
}


@dataclass(frozen=True)
class Mesh:
    """Section and layers of a mesh: ``layers`` times those of the family's coarsest one.

    With no layers it is a level of that name, as it is.
    """

    section: str
    layers: int = 0

    @property
    def name(self) -> str:
        """Name in tables and files."""
        return f"{self.section} x{self.layers}" if self.layers else self.section

    def level(self, case: Case) -> MeshLevel:
        """The mesh of that winding."""
        if not self.layers:
            return LEVELS[self.section]
        section = SECTIONS[self.section]
        layers = self.layers * (case.linear if section.order == 1 else case.quadratic)
        return replace(section, axial_size=1e3 * case.winding.period / layers)


#: From cheap to dear.
MESHES = (
    Mesh("linear", 1),
    Mesh("fine"),
    Mesh("finer"),
    Mesh("quadratic", 1),
    Mesh("linear", 2),
    Mesh("quadratic", 2),
    Mesh("linear-2", 2),
    Mesh("quadratic-2", 1),
)
#: The finest quadratic mesh, on which a cell is solved that keeps its plane of symmetry.
FINEST = Mesh("quadratic-2", 2)
