"""Residuals of the adjusted law over the noise, and their derivatives."""

import math
from dataclasses import dataclass, replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from calibration.measured.adjusted_law import NAMES, AdjustedLaw, default_parameters
from calibration.measured.csv_file import ANGLE, OUTPUTS, PLANE, Measured
from rodmodel import FixedStep, Rod
from rodmodel.io import OuterWall, scaled_ends


@dataclass(frozen=True)
class Noise:
    """Standard deviation of angles [rad] and of coordinates [m]; only their ratio, if it is estimated.

    The noise of a bending plane is that of angles over the sine of the bending angle, as for the tip's
    direction: a rod that hardly bends has no plane.
    """

    angle: float = math.radians(1.0)
    position: float = 0.5e-3
    estimate: bool = False


class Residuals:
    """Residuals over the noise (measured − predicted) and their derivatives, at any parameters."""

    def __init__(self, rod: Rod, measured: Measured, noise: Noise, wall: OuterWall) -> None:
        self.rod = rod
        self._wall = wall
        self.measured = measured
        self._columns = [OUTPUTS.index(name) for name in measured.outputs]
        self._last: tuple[bytes, np.ndarray, np.ndarray] | None = None
        self._planes = np.array([name == PLANE for name in measured.outputs])
        angle = self.angle(default_parameters())
        # From the map's prediction: weights with the noise of the measurement would bias the fit. The lower
        # bound avoids a zero weight for straight rods.
        sine = np.maximum(np.abs(np.sin(angle)), 1e-3)
        one = {ANGLE: np.full_like(angle, 1.0 / noise.angle), PLANE: sine / noise.angle}
        place = np.full_like(angle, 1.0 / noise.position)
        self.weight = np.stack([one.get(name, place) for name in measured.outputs], axis=1)

    def __call__(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return residuals (rows, outputs), NaN without equilibrium, and slopes (residuals, parameters)."""
        outputs, slopes = self._evaluate(parameters)
        off = self.measured.values - outputs[:, self._columns]
        off = np.where(self._planes, np.mod(off + math.pi, 2.0 * math.pi) - math.pi, off)
        by = -self.weight[:, :, None] * slopes[:, self._columns]
        return self.weight * off, by.reshape(-1, len(NAMES))

    def angle(self, parameters: np.ndarray) -> np.ndarray:
        """Return the bending angle of each row [rad]."""
        return self._evaluate(parameters)[0][:, 0]

    def inside(self, parameters: np.ndarray) -> np.ndarray:
        """Return whether the adjusted pressures of each row are in the map's domain."""
        adjusted = parameters[1:4] * self.measured.pressure + parameters[4:7]
        return np.array([bool(self.rod.domain.covers_pressure(p)) for p in adjusted])

    def _evaluate(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        # Cached: least squares calls for residuals and slopes separately.
        here = parameters.tobytes()
        if self._last is None or self._last[0] != here:
            rows = (self.measured.pressure, self.measured.tip_force, self.measured.gravity)
            outputs, slopes = _outputs_and_slopes(self.rod, self._wall, jnp.asarray(parameters), rows)
            self._last = here, np.asarray(outputs), np.asarray(slopes)
        return self._last[1], self._last[2]


@eqx.filter_jit
def _outputs_and_slopes(
    rod: Rod, wall: OuterWall, parameters: Float[Array, "10"], rows: tuple[Any, ...]
) -> tuple[Float[Array, "rows 5"], Float[Array, "rows 5 10"]]:
    """Return angle, plane and tip position of each row, and their derivatives by the parameters."""

    def predict(parameters: Float[Array, "10"], row: tuple[Any, ...]) -> tuple[Array, Array]:
        pressure, force, gravity = row
        ends = scaled_ends(rod.actuator, parameters[0])
        with_law = replace(rod, section=AdjustedLaw(rod.section, parameters, wall), actuator=ends)
        solved = with_law.solve(pressure, tip_force=force, gravity=gravity, throw=False, solver=FixedStep())
        bend = jnp.stack([solved.bending_angle, solved.bending_plane])
        outputs = jnp.concatenate([bend, solved.tip_position])
        outputs = jnp.where(solved.converged, outputs, jnp.nan)
        return outputs, outputs

    slopes, outputs = jax.vmap(jax.jacfwd(predict, has_aux=True), in_axes=(None, 0))(parameters, rows)
    return outputs, slopes
