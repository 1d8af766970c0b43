"""Fit of the adjusted law to measurements, with standard errors and 95 % intervals."""

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import least_squares
from scipy.stats import norm, t

from calibration.adjusted_law import NAMES, AdjustedLaw, OuterWall, default_parameters, scaled_ends
from calibration.identifiability import Held, identify
from calibration.measured import ANGLE, PLANE, POSITIONS, Measured
from calibration.profile import LowerMinimumError, profile_intervals
from rodmodel import FixedStep, Rod

# By how much each parameter may plausibly differ from its default: a fifth, and 2 kPa.
SPREAD = np.array([0.2] * 4 + [2e3] * 3 + [0.2] * 3)
# Gains are held last: they say most of what differs from one actuator to the next; walls first.
_KEEP_FIRST = (1, 0, 0, 0, 2, 2, 2, 3, 3, 3)
_LEAST = np.array([0.1] * 4 + [-50e3] * 3 + [-0.9] * 3)
_MOST = np.array([10.0] * 4 + [50e3] * 3 + [9.0] * 3)
_ALL_OUTPUTS = (ANGLE, PLANE, *POSITIONS)
_REPEATS = 5
# Noise estimated from data without any, of what is given: what the rod's own tolerance leaves is below it.
_LEAST_NOISE = 1e-6


class MeasuredFitError(RuntimeError):
    """The fit cannot be done or has not converged; the message is one line."""


@dataclass(frozen=True)
class Noise:
    """Standard deviation of angles [rad] and of each coordinate [m]; or only their ratio, if to be estimated.

    A bending plane is as uncertain as the tip's direction, so that its own noise is that of the angles over
    the sine of the bending angle: a rod that hardly bends has no plane.
    """

    angle: float = math.radians(1.0)
    position: float = 0.5e-3
    estimate: bool = False


@dataclass(frozen=True)
class MeasuredFit:
    """Parameters, and how sure they are.

    Attributes
    ----------
    parameters, standard_error : in the order and units of `NAMES`; the error of a held one is NaN.
    interval : 95 %, (10, 2); infinite where the map does not reach so far.
    held : what the data do not tell.
    noise_scale : what the given noise was multiplied by; 1 unless it was to be estimated.
    chi_square : weighted squares over degrees of freedom, with the noise as given, of the map and adjusted.
    of_map, adjusted : measured less predicted [rad, m], (rows, outputs).
    angle : predicted bending angle, adjusted [rad].
    weight : one over the noise of each measurement, as given, (rows, outputs).
    extrapolated : rows whose adjusted pressures are above the map's domain.
    """

    parameters: np.ndarray
    standard_error: np.ndarray
    interval: np.ndarray
    held: tuple[Held, ...]
    noise_scale: float
    chi_square: tuple[float, float]
    of_map: np.ndarray
    adjusted: np.ndarray
    angle: np.ndarray
    weight: np.ndarray
    extrapolated: int


def fit_measured(rod: Rod, measured: Measured, noise: Noise, wall: OuterWall | None = None) -> MeasuredFit:
    """Estimate the parameters of [`AdjustedLaw`][] by weighted nonlinear least squares.

    Standard errors are those of the linearised model, from (JᵀJ)⁻¹ of the Jacobian over the noise. Intervals
    are of the profile of the squares, as the law bends within them; see
    [`profile_intervals`][calibration.profile.profile_intervals]. What the data do not tell is found at the
    default and held there; see [`identify`][calibration.identifiability.identify].

    Parameters
    ----------
    rod : of the map.
    measured : rows.
    noise : of the measurements. Where it is to be estimated, its squares are multiplied by those of the
        residuals over the degrees of freedom, and the intervals are those of Student's t.
    wall : the outer wall that the wall variation counts in.

    Raises
    ------
    MeasuredFitError
        Where the map has no equilibrium for a row, too few rows are left to estimate the noise, or the fit
        does not converge inside the bounds.
    """
    residuals = _Residuals(rod, measured, noise, OuterWall() if wall is None else wall)
    default = default_parameters()
    of_map, slopes = residuals(default)
    bad = [line for line, row in zip(measured.lines, of_map, strict=True) if not np.all(np.isfinite(row))]
    if bad:
        raise MeasuredFitError(f"no equilibrium of the map for the measurement on line {bad[0]}")
    start = default
    for _ in range(_REPEATS):
        estimate = _estimate(residuals, slopes, noise, start)
        try:
            interval = residuals.intervals(estimate)
            break
        except LowerMinimumError as lower:
            # A profile bounds its own parameter only.
            start = np.clip(_parameters(estimate.free, lower.parameters), _LEAST, _MOST)
    else:
        raise MeasuredFitError("least squares have more minima than were searched: the data hardly tell")
    found = estimate.parameters
    adjusted, _ = residuals(found)
    inside = residuals.inside(found)
    return MeasuredFit(
        parameters=found,
        standard_error=estimate.standard_error,
        interval=interval,
        held=estimate.held,
        noise_scale=estimate.noise_scale,
        chi_square=(float(np.sum(of_map**2)) / of_map.size, estimate.chi_square),
        of_map=of_map / residuals.weight,
        adjusted=adjusted / residuals.weight,
        angle=residuals.angle(found),
        weight=residuals.weight,
        extrapolated=int(np.sum(~inside)),
    )


@dataclass(frozen=True)
class _Estimate:
    """A minimum of the squares; `rise` of them at the ends of 95 % intervals, `free` parameters by number."""

    parameters: np.ndarray
    standard_error: np.ndarray
    free: list[int]
    held: tuple[Held, ...]
    noise_scale: float
    chi_square: float
    rise: float


def _estimate(residuals: "_Residuals", slopes: np.ndarray, noise: Noise, start: np.ndarray) -> _Estimate:
    """Least squares over what the slopes at the default tell, with the noise as given or estimated."""
    scale, free_before = 1.0, None
    for _ in range(_REPEATS):
        free, held = identify(slopes / scale, NAMES, SPREAD, _KEEP_FIRST)
        if free == free_before:
            break
        found = residuals.minimise(free, start)
        adjusted, at_end = residuals(found)
        degrees = adjusted.size - len(free)
        if degrees < 1 and noise.estimate:
            raise MeasuredFitError(
                f"{adjusted.size} measured numbers for {len(free)} parameters: none left for the noise"
            )
        squares = float(np.sum(adjusted**2)) / max(degrees, 1)
        if not noise.estimate:
            break
        scale, free_before = max(math.sqrt(squares), _LEAST_NOISE), free
    error = np.full(len(NAMES), np.nan)
    if free:
        inverse = np.linalg.pinv(at_end[:, free] * SPREAD[free])
        error[free] = scale * SPREAD[free] * np.linalg.norm(inverse, axis=1)
    width = float(t.ppf(0.975, degrees)) if noise.estimate else float(norm.ppf(0.975))
    return _Estimate(found, error, free, tuple(held), scale, squares, (scale * width) ** 2)


class _Residuals:
    """Measured less predicted over the noise, and its slope, at any parameters."""

    def __init__(self, rod: Rod, measured: Measured, noise: Noise, wall: OuterWall) -> None:
        self._rod = rod
        self._wall = wall
        self._measured = measured
        self._columns = [_ALL_OUTPUTS.index(name) for name in measured.outputs]
        self._last: tuple[bytes, np.ndarray, np.ndarray] | None = None
        self._planes = np.array([name == PLANE for name in measured.outputs])
        angle = self.angle(default_parameters())
        # Of the map's prediction, not of the measurement: weights that share its noise would bias the fit. A
        # thousandth stands for zero, where a plane says nothing.
        sine = np.maximum(np.abs(np.sin(angle)), 1e-3)
        one = {ANGLE: np.full_like(angle, 1.0 / noise.angle), PLANE: sine / noise.angle}
        place = np.full_like(angle, 1.0 / noise.position)
        self.weight = np.stack([one.get(name, place) for name in measured.outputs], axis=1)

    def __call__(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (rows, outputs), NaN without an equilibrium, and slopes (residuals, parameters)."""
        outputs, slopes = self._evaluate(parameters)
        off = self._measured.values - outputs[:, self._columns]
        off = np.where(self._planes, np.mod(off + math.pi, 2.0 * math.pi) - math.pi, off)
        by = -self.weight[:, :, None] * slopes[:, self._columns]
        return self.weight * off, by.reshape(-1, len(NAMES))

    def minimise(self, free: list[int], start: np.ndarray) -> np.ndarray:
        """Least squares over the free parameters from a start, the others at their default."""
        if not free:
            return default_parameters()
        ended = least_squares(
            lambda x: self._scaled(free, x)[0],
            _scaled(free, start),
            lambda x: self._scaled(free, x)[1],
            bounds=tuple(_scaled(free, bound) for bound in (_LEAST, _MOST)),
            xtol=1e-9,
            ftol=1e-10,
            gtol=1e-10,
            max_nfev=100,
        )
        if not ended.success:
            raise MeasuredFitError(f"least squares did not converge in {ended.nfev} evaluations")
        if np.any(ended.active_mask):
            n = int(np.flatnonzero(ended.active_mask)[0])
            raise MeasuredFitError(
                f"{NAMES[free[n]]} went to its bound {_parameters(free, ended.x)[free[n]]:g}: the data are "
                "not of the map's actuator; are columns swapped, or their units others?"
            )
        return _parameters(free, ended.x)

    def intervals(self, estimate: _Estimate) -> np.ndarray:
        """Where the squares, least over the other free parameters, have risen, (10, 2); NaN of held ones."""
        free, interval = estimate.free, np.full((len(NAMES), 2), np.nan)
        if free:
            found, least, most = (_scaled(free, p) for p in (estimate.parameters, _LEAST, _MOST))
            ends = profile_intervals(partial(self._scaled, free), found, estimate.rise, least, most)
            interval[free] = default_parameters()[free, None] + SPREAD[free, None] * ends
        return interval

    def _scaled(self, free: list[int], x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n,) and slopes (n, free) at free parameters over their spread."""
        residual, slopes = self(_parameters(free, x))
        return residual.ravel(), slopes[:, free] * SPREAD[free]

    def angle(self, parameters: np.ndarray) -> np.ndarray:
        """Bending angle of each row [rad]."""
        return self._evaluate(parameters)[0][:, 0]

    def inside(self, parameters: np.ndarray) -> np.ndarray:
        """Whether the adjusted pressures of each row are in the map's domain."""
        seen = parameters[1:4] * self._measured.pressure + parameters[4:7]
        return np.array([bool(self._rod.domain.covers_pressure(p)) for p in seen])

    def _evaluate(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        # Least squares asks for residuals and slopes apart, at the same place.
        here = parameters.tobytes()
        if self._last is None or self._last[0] != here:
            rows = (self._measured.pressure, self._measured.tip_force, self._measured.gravity)
            outputs, slopes = _outputs_and_slopes(self._rod, self._wall, jnp.asarray(parameters), rows)
            self._last = here, np.asarray(outputs), np.asarray(slopes)
        return self._last[1], self._last[2]


def _scaled(free: list[int], parameters: np.ndarray) -> np.ndarray:
    """Free parameters as differences from their default over their spread."""
    return ((parameters - default_parameters()) / SPREAD)[free]


def _parameters(free: list[int], x: np.ndarray) -> np.ndarray:
    """All parameters, of which the free ones are given by `_scaled`."""
    parameters = default_parameters()
    parameters[free] += SPREAD[free] * x
    return parameters


@eqx.filter_jit
def _outputs_and_slopes(
    rod: Rod, wall: OuterWall, parameters: Float[Array, "10"], rows: tuple[Any, ...]
) -> tuple[Float[Array, "rows 5"], Float[Array, "rows 5 10"]]:
    """Angle, plane and tip position of each row, and their derivatives by the parameters."""

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
