"""Fit of the adjusted law to measurements, with standard errors and 95 % intervals."""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import norm, t

from calibration.measured.adjusted_law import NAMES, default_parameters, units_of
from calibration.measured.csv_file import Measured
from calibration.measured.doubts import doubts_of_fit
from calibration.measured.held_out import held_out
from calibration.measured.identifiability import Held, identify
from calibration.measured.profile_intervals import LowerMinimumError, profile_intervals
from calibration.measured.residuals import Noise, Residuals
from calibration.measured.states import Repeats, states_of
from rodmodel import Rod
from rodmodel.io import OuterWall

# Plausible spread of each parameter about its default; of offsets, relative to the map's largest pressure.
_SPREAD = np.array([0.2] * 4 + [0.035] * 3 + [0.2] * 3)
# Rank for holding parameters at their defaults: wall variations first, gains last, because they describe most
# of the difference between actuators.
_KEEP_FIRST = (1, 0, 0, 0, 2, 2, 2, 3, 3, 3)
# Bounds of the parameters; of offsets, likewise.
_LEAST = np.array([0.1] * 4 + [-0.9] * 6)
_MOST = np.array([10.0] * 4 + [0.9] * 3 + [9.0] * 3)
# Repetitions of the fit at most, with new noise or from a lower minimum.
_REPEATS = 5
# Evaluations of a minimisation at most; data of the map's actuator take ten or twenty.
_EVALUATIONS = 100
# Lower bound of the estimated noise relative to the given one, above the tolerance of the rod's solver.
_LEAST_NOISE = 1e-6


class MeasuredFitError(RuntimeError):
    """Error for a fit that is impossible; the message is one line."""


@dataclass(frozen=True)
class MeasuredFit:
    """Fitted parameters with their uncertainty.

    Attributes
    ----------
    parameters, standard_error : values in the order and units of `NAMES`; the error of a held parameter is
        NaN.
    interval : 95 % intervals, (10, 2); infinite beyond the map's domain, NaN if not computed.
    held : parameters that the data do not determine.
    noise_scale : factor of the given noise; 1 unless the noise was estimated.
    chi_square : weighted squares over degrees of freedom with the given noise, of the map and adjusted.
    of_map, adjusted : residuals of the map and of the adjusted law [rad, m], (states, outputs).
    held_out : leave-one-out residuals of the adjusted law; see `held_out`.
    angle : predicted bending angle of the adjusted law [rad].
    weight : one over the given noise of each measurement, (states, outputs).
    extrapolated : number of states whose adjusted pressures are outside the map's domain.
    repeats : states, and the rows that belong to them.
    doubts : reasons not to use the adjusted law; empty if there are none.
    """

    parameters: np.ndarray
    standard_error: np.ndarray
    interval: np.ndarray
    held: tuple[Held, ...]
    noise_scale: float
    chi_square: tuple[float, float]
    of_map: np.ndarray
    adjusted: np.ndarray
    held_out: np.ndarray
    angle: np.ndarray
    weight: np.ndarray
    extrapolated: int
    repeats: Repeats
    doubts: tuple[str, ...]


def fit_measured(
    rod: Rod, measured: Measured, noise: Noise, wall: OuterWall | None = None, insist: bool = False
) -> MeasuredFit:
    """Estimate the parameters of `AdjustedLaw` by weighted nonlinear least squares.

    Standard errors are those of the linearised model, from (JᵀJ)⁻¹ of the Jacobian over the noise. Intervals
    come from the profile of the squares, because the model is not linear within them; see
    `profile_intervals`. Parameters that the data do not determine are held at their defaults; see `identify`.
    Repeats of a state count as one measurement. A fit that does not converge is doubtful, and has no
    intervals.

    Parameters
    ----------
    rod : rod of the map.
    measured : measurements.
    noise : noise of the measurements. If it is to be estimated, its variance is scaled by the squared
        residuals over the degrees of freedom, and intervals use Student's t.
    wall : outer wall to which the wall variation refers.
    insist : compute intervals also for a doubtful fit, which may take minutes.

    Raises
    ------
    MeasuredFitError
        If the map has no equilibrium for a row, there are too few rows to estimate the noise, or the data
        hardly determine the parameters.
    """
    repeats = states_of(measured)
    residuals = Residuals(rod, repeats.measured, noise, OuterWall() if wall is None else wall)
    default = default_parameters()
    of_map, slopes = residuals(default)
    lines = repeats.measured.lines
    bad = [line for line, row in zip(lines, of_map, strict=True) if not np.all(np.isfinite(row))]
    if bad:
        raise MeasuredFitError(f"no equilibrium of the map for the measurement on line {bad[0]}")
    start = default
    for _ in range(_REPEATS):
        estimate = _estimate(residuals, slopes, noise, start)
        found = _result(residuals, estimate, of_map, repeats)
        if estimate.unfinished or (found.doubts and not insist):
            return found
        try:
            found.interval[:] = _intervals(residuals, estimate)
            return found
        except LowerMinimumError as lower:
            # A profile clips its own parameter only.
            ends = (bound * units_of(rod.domain) for bound in (_LEAST, _MOST))
            start = np.clip(_parameters(residuals, estimate.free, lower.parameters), *ends)
    raise MeasuredFitError("least squares: found ever lower minima; the data hardly determine the parameters")


@dataclass(frozen=True)
class _Estimate:
    """Minimum of the squares, with `free` parameters by index and the `rise` at the ends of intervals.

    `unfinished` says why it is no minimum yet; empty if it is one.
    """

    parameters: np.ndarray
    standard_error: np.ndarray
    free: list[int]
    held: tuple[Held, ...]
    at_bound: list[int]
    noise_scale: float
    chi_square: float
    rise: float
    unfinished: tuple[str, ...]


def _estimate(residuals: Residuals, slopes: np.ndarray, noise: Noise, start: np.ndarray) -> _Estimate:
    """Minimise over the parameters that the data determine, with given or estimated noise."""
    scale, free_before = 1.0, None
    for _ in range(_REPEATS):
        free, held = identify(slopes / scale, NAMES, _spread(residuals), _KEEP_FIRST)
        if free == free_before:
            break
        found, at_bound, unfinished = _minimise(residuals, free, start)
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
        spread = _spread(residuals)[free]
        error[free] = scale * spread * np.linalg.norm(np.linalg.pinv(at_end[:, free] * spread), axis=1)
    width = float(t.ppf(0.975, degrees)) if noise.estimate else float(norm.ppf(0.975))
    rise = (scale * width) ** 2
    return _Estimate(found, error, free, tuple(held), at_bound, scale, squares, rise, unfinished)


def _result(residuals: Residuals, estimate: _Estimate, of_map: np.ndarray, repeats: Repeats) -> MeasuredFit:
    """Return the fit without intervals, with its doubts."""
    found, free = estimate.parameters, estimate.free
    adjusted, slopes = residuals(found)
    outside = int(np.sum(~residuals.inside(found)))
    left_out = held_out(adjusted, slopes[:, free] * _spread(residuals)[free], estimate.noise_scale)
    return MeasuredFit(
        parameters=found,
        standard_error=estimate.standard_error,
        interval=np.full((len(NAMES), 2), np.nan),
        held=estimate.held,
        noise_scale=estimate.noise_scale,
        chi_square=(float(np.sum(of_map**2)) / of_map.size, estimate.chi_square),
        of_map=of_map / residuals.weight,
        adjusted=adjusted / residuals.weight,
        held_out=left_out / residuals.weight,
        angle=residuals.angle(found),
        weight=residuals.weight,
        extrapolated=outside,
        repeats=repeats,
        doubts=estimate.unfinished
        + doubts_of_fit(
            residuals.rod,
            repeats.measured,
            found,
            (of_map, adjusted),
            residuals.weight,
            free,
            estimate.at_bound,
            outside,
        ),
    )


def _minimise(
    residuals: Residuals, free: list[int], start: np.ndarray
) -> tuple[np.ndarray, list[int], tuple[str, ...]]:
    """Minimise over the free parameters.

    Returns
    -------
    parameters : all of them.
    at_bound : indices of those at bounds.
    unfinished : why this is no minimum yet; empty if it is one.
    """
    if not free:
        return default_parameters(), [], ()
    ended = least_squares(
        lambda x: _over_spread(residuals, free, x)[0],
        _scaled(residuals, free, start),
        lambda x: _over_spread(residuals, free, x)[1],
        bounds=_bounds(residuals, free),
        xtol=1e-9,
        ftol=1e-10,
        gtol=1e-10,
        max_nfev=_EVALUATIONS,
    )
    unfinished = () if ended.success else (f"least squares did not converge in {ended.nfev} evaluations",)
    at_bound = [free[n] for n in np.flatnonzero(ended.active_mask)]
    return _parameters(residuals, free, ended.x), at_bound, unfinished


def _intervals(residuals: Residuals, estimate: _Estimate) -> np.ndarray:
    """Return the profile intervals of the parameters, (10, 2); NaN for held ones."""
    free, interval = estimate.free, np.full((len(NAMES), 2), np.nan)
    if free:
        found, (least, most) = _scaled(residuals, free, estimate.parameters), _bounds(residuals, free)
        ends = profile_intervals(partial(_over_spread, residuals, free), found, estimate.rise, least, most)
        interval[free] = default_parameters()[free, None] + _spread(residuals)[free, None] * ends
    return interval


def _over_spread(residuals: Residuals, free: list[int], x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return residuals (n,) and slopes (n, free) at scaled free parameters, see `_scaled`."""
    residual, slopes = residuals(_parameters(residuals, free, x))
    return residual.ravel(), slopes[:, free] * _spread(residuals)[free]


def _spread(residuals: Residuals) -> np.ndarray:
    return _SPREAD * units_of(residuals.rod.domain)


def _bounds(residuals: Residuals, free: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the scaled bounds of the free parameters."""
    units = units_of(residuals.rod.domain)
    return _scaled(residuals, free, _LEAST * units), _scaled(residuals, free, _MOST * units)


def _scaled(residuals: Residuals, free: list[int], parameters: np.ndarray) -> np.ndarray:
    """Return the free parameters as differences from their defaults over their spreads."""
    scaled: np.ndarray = ((parameters - default_parameters()) / _spread(residuals))[free]
    return scaled


def _parameters(residuals: Residuals, free: list[int], x: np.ndarray) -> np.ndarray:
    """Return all parameters from scaled free ones: the inverse of `_scaled`."""
    parameters = default_parameters()
    parameters[free] += _spread(residuals)[free] * x
    return parameters
