"""How contact changes the stiffness of the cell."""

import numpy as np
from jaxtyping import Float

from fem_reference.cell.equations import CORE_CONTACT, CellEquations
from fem_reference.cell.state import CellLinearisation, Configuration
from fem_reference.cell.unknowns import CellUnknowns
from fem_reference.elements import convexified
from fem_reference.solver import Contact


class CellContact(Contact[Configuration, CellLinearisation]):
    """Contact of the chambers' walls with themselves, and of the cavity's wall with the core.

    Parameters
    ----------
    equations : of the cell.
    """

    def __init__(self, equations: CellEquations) -> None:
        self._equations = equations

    def convexified(self, linear: CellLinearisation) -> Float[np.ndarray, " nonzeros"]:
        """See `Contact.convexified`."""
        equations, frame = self._equations, linear.frame
        unknowns = CellUnknowns(frame, equations.nodal.fold)
        return convexified(linear.data, equations.walls, frame.positions, equations.pattern, unknowns)

    def core_curvature_stiffness(self, linear: CellLinearisation) -> Float[np.ndarray, " nonzeros"]:
        """See `Contact.core_curvature_stiffness`."""
        pattern, core, frame = self._equations.pattern, self._equations.core_contact, linear.frame
        data = np.zeros(len(pattern))
        concave = core.response(frame.positions, frame.series).node_concave
        pattern.add_group(data, CORE_CONTACT, frame.rotate_blocks(core.nodes[:, None], concave))
        return data
