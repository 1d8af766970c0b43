"""The potential of the manufactured cell as a law, whose one unknown is a moment that it is off by."""

import jax.numpy as jnp
from manufactured_cell import potential

from calibration.studies.other_laws import _Contracted
from rodmodel import SectionLaw


class ManufacturedInCurvature(_Contracted):
    """The manufactured potential at one pressure, off by a constant moment."""

    offset: jnp.ndarray
    pressure: jnp.ndarray

    def energy(self, curvature):
        return potential(curvature, self.pressure) + self.offset @ curvature


class Manufactured(SectionLaw):
    """The manufactured potential, off by a constant moment."""

    offset: jnp.ndarray

    def at(self, pressure):
        return ManufacturedInCurvature(self.offset, pressure)
