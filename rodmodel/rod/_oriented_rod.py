"""Rods of all orientations ψ of a winding."""

from typing import final

import equinox as eqx
from jaxtyping import ArrayLike, Float

from rodmodel.actuator import Actuator, Domain
from rodmodel.error_bound import ErrorBound
from rodmodel.rod._rod import Rod
from rodmodel.section import OrientedNetwork


@final
class OrientedRod(eqx.Module):
    """Actuators that differ only in the orientation ψ of their winding; made by `rodmodel.load_oriented`.

    Attributes
    ----------
    section : section laws of all orientations.
    actuator : dimensions and masses.
    domain : loads inside which the sections were calibrated.
    error_bound : bound that the errors of 90 % of states keep; a number is a constant one of θ [rad].
    """

    section: OrientedNetwork
    actuator: Actuator
    domain: Domain
    error_bound: ErrorBound = eqx.field(converter=ErrorBound.of)

    def at_psi(self, psi: Float[ArrayLike, ""]) -> Rod:
        """Return the rod of the winding at an orientation.

        Predictions can be differentiated by ψ and mapped over it:
        ``jax.grad(lambda psi: rods.at_psi(psi).solve(pressure).bending_angle)``.

        Parameters
        ----------
        psi : azimuth of a crossing of the winding from the centre of chamber 1 [rad].
        """
        return Rod(self.section.at_psi(psi), self.actuator, self.domain, self.error_bound)
