"""Force groups: elements of one kind that share a potential, by their energy, forces and stiffness.

A stiff group has a force of its own, such as an element's pressure or a segment's tension, that is an unknown
while Newton's method iterates (see `newton`). It is condensed element by element, so that the sparse system
has the points' displacements alone. Lengths mm, forces N.
"""

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from fem_reference.elements.enclosed_volume import VolumePatch
from fem_reference.elements.solid import SolidElements
from fem_reference.elements.thread import ThreadSegments
from fem_reference.elements.viscous_solid import ViscousSolid

Points = Float[np.ndarray, "points 3"]
#: A stiff group's own forces, and their gradients in the displacements: one row an element.
Own = Float[np.ndarray, "..."]
_NONE: Own = np.empty(0)


class Forces(NamedTuple):
    """Forces of every element on its points, and the own forces that the material's law gives.

    ``law`` is empty for a group without own forces, and for one that evaluates its law anew when a step is
    taken.
    """

    force: Float[np.ndarray, "elements dofs"]
    law: Own = _NONE


class Response(NamedTuple):
    """`Forces` with the stiffness, and the gradient of what own forces are conjugate to: volume or length."""

    force: Float[np.ndarray, "elements dofs"]
    stiffness: Float[np.ndarray, "elements dofs dofs"]
    law: Own = _NONE
    gradient: Own | None = None


@runtime_checkable
class ForceGroup(Protocol):
    """What the assembly asks of a group; ``own`` is None for a group without own forces."""

    @property
    def connectivity(self) -> Int[np.ndarray, "elements points"]:
        """Points of every element."""
        ...

    @property
    def padding(self) -> Bool[np.ndarray, "elements points"] | None:
        """Points of no weight, which fill up short rows of ``connectivity``; None where there are none."""
        ...

    def energy(self, positions: Points) -> float:
        """Potential energy [N mm]."""
        ...

    def force(self, positions: Points, own: Own | None) -> Forces:
        """Forces at these positions."""
        ...

    def response(self, positions: Points, own: Own | None) -> Response:
        """Forces and stiffness.

        ``own`` is for the geometric part of the stiffness. By default it follows from the positions, and the
        stiffness is the Hessian of the energy.
        """
        ...


@runtime_checkable
class StiffGroup(ForceGroup, Protocol):
    """A group with own forces."""

    def own_after(self, positions: Points, own: Own, law: Own, gradient: Own, move: Points) -> Own:
        """Own forces after a Newton step.

        Parameters
        ----------
        positions : where the step begins.
        own : own forces there.
        law, gradient : the parts of the group's `Response` there.
        move : displacement of every point in the step.
        """
        ...


@runtime_checkable
class Displacements(Protocol):
    """Elements whose forces follow from the positions alone."""

    @property
    def connectivity(self) -> Int[np.ndarray, "elements points"]:
        """Points of every element."""
        ...

    def energy(self, positions: Points) -> float:
        """Energy [N mm]."""
        ...

    def force(self, positions: Points) -> Float[np.ndarray, "elements dofs"]:
        """Forces on every element's points."""
        ...

    def response(
        self, positions: Points
    ) -> tuple[Float[np.ndarray, "elements dofs"], Float[np.ndarray, "elements dofs dofs"]]:
        """Forces and stiffness on every element's points."""
        ...


class DisplacementGroup:
    """Force group of elements without own forces.

    Parameters
    ----------
    elements : see `Displacements`.
    padding : see `ForceGroup`.
    """

    def __init__(
        self, elements: Displacements, padding: Bool[np.ndarray, "elements points"] | None = None
    ) -> None:
        self.connectivity, self.padding = elements.connectivity, padding
        self._elements = elements

    def energy(self, positions: Points) -> float:
        """See `ForceGroup.energy`."""
        return self._elements.energy(positions)

    def force(self, positions: Points, own: Own | None) -> Forces:
        """See `ForceGroup.force`."""
        return Forces(self._elements.force(positions))

    def response(self, positions: Points, own: Own | None) -> Response:
        """See `ForceGroup.response`."""
        return Response(*self._elements.response(positions))


class SolidGroup:
    """Hexahedra with their pressures π_j as own forces.

    Parameters
    ----------
    solid : elements.
    viscous : resistance in a step in time, or None.
    """

    padding = None

    def __init__(self, solid: SolidElements, viscous: ViscousSolid | None = None) -> None:
        self.connectivity = solid.connectivity
        self._solid, self._viscous = solid, viscous

    def energy(self, positions: Points) -> float:
        """Strain energy [N mm]."""
        return self._solid.energy(positions)

    def force(self, positions: Points, own: Own | None) -> Forces:
        """See `ForceGroup.force`."""
        force, law = self._solid.force(positions)
        return Forces(force if self._viscous is None else force + self._viscous.force(positions), law)

    def response(self, positions: Points, own: Own | None) -> Response:
        """See `ForceGroup.response`."""
        force, stiffness, gradient, law = self._solid.response(positions, own)
        if self._viscous is not None:
            force += self._viscous.force(positions)
            stiffness += self._viscous.matrices
        return Response(force, stiffness, law, gradient)

    def own_after(self, positions: Points, own: Own, law: Own, gradient: Own, move: Points) -> Own:
        """See `StiffGroup.own_after`."""
        return self._solid.pressure_after(law, gradient, move)


class ThreadGroup:
    """Thread segments with their tensions as own forces."""

    def __init__(self, thread: ThreadSegments) -> None:
        self.connectivity, self.padding = thread.connectivity, thread.padding
        self._thread = thread

    def energy(self, positions: Points) -> float:
        """Energy of the stretch [N mm]."""
        return self._thread.energy(positions)

    def force(self, positions: Points, own: Own | None) -> Forces:
        """See `ForceGroup.force`."""
        return Forces(self._thread.force(positions, own))

    def response(self, positions: Points, own: Own | None) -> Response:
        """See `ForceGroup.response`."""
        force, stiffness, gradient = self._thread.response(positions, own)
        return Response(force, stiffness, gradient=gradient)

    def own_after(self, positions: Points, own: Own, law: Own, gradient: Own, move: Points) -> Own:
        """See `StiffGroup.own_after`."""
        return self._thread.tension_after(positions, own, lengthening(gradient, move[self.connectivity]))


class FollowerPressure:
    """Follower pressure on one patch of a chamber's wall: its energy is −p V.

    Parameters
    ----------
    patch : of the wall, or of what closes it.
    pressure : p [MPa].
    """

    padding = None

    def __init__(self, patch: VolumePatch, pressure: float) -> None:
        self.connectivity = patch.connectivity
        self._patch, self._pressure = patch, pressure

    def energy(self, positions: Points) -> float:
        """See `ForceGroup.energy`."""
        return -self._pressure * self._patch.volume(positions)

    def force(self, positions: Points, own: Own | None) -> Forces:
        """See `ForceGroup.force`."""
        return Forces(-self._pressure * self._patch.gradient(positions))

    def response(self, positions: Points, own: Own | None) -> Response:
        """See `ForceGroup.response`; the gradient is that of the volume."""
        gradient = self._patch.gradient(positions)
        return Response(
            -self._pressure * gradient, -self._pressure * self._patch.hessian(positions), gradient=gradient
        )


def lengthening(
    gradient: Float[np.ndarray, "elements dofs"], move: Float[np.ndarray, "elements points 3"]
) -> Float[np.ndarray, " elements"]:
    """Change of every element's length when its points move."""
    return np.einsum("ba,ba->b", gradient, move.reshape(gradient.shape))
