"""Rods of all orientations of a winding, of which ψ is an argument."""

from typing import final

import equinox as eqx
from jaxtyping import ArrayLike, Float

from rodmodel.actuator import Actuator, Domain, Number
from rodmodel.rod._rod import Rod
from rodmodel.section import OrientedNetwork


@final
class OrientedRod(eqx.Module):
    """Actuators that differ in the orientation ψ of their winding alone; `rodmodel.load_oriented` makes it.

    Attributes
    ----------
    section : laws of the sections of all orientations.
    actuator : lengths and masses.
    domain : the loads within which the sections were calibrated.
    angle_error : within which the bending angle of the finite elements is in 90 % of states [rad].
    """

    section: OrientedNetwork
    actuator: Actuator
    domain: Domain
    angle_error: Number

    def at_psi(self, psi: Float[ArrayLike, ""]) -> Rod:
        """Rod of the winding at an orientation.

        What the rod predicts can be differentiated by ψ and mapped over it, like a pressure:
        ``jax.grad(lambda psi: rods.at_psi(psi).solve(pressure).bending_angle)``.

        Parameters
        ----------
        psi : azimuth of a crossing of the winding from the centre of chamber 1 [rad].
        """
        return Rod(self.section.at_psi(psi), self.actuator, self.domain, self.angle_error)
