"""How far an adjusted rod is off states that its fit has not seen, without fitting it anew for each."""

import math

import numpy as np

from calibration.measured.csv_file import ANGLE, POSITIONS, Measured


def held_out(residuals: np.ndarray, slopes: np.ndarray, noise_scale: float) -> np.ndarray:
    """Residuals of each state, left out of the fit.

    Of the model that is linear about the minimum, the residuals of a state that is left out are (1 − H)⁻¹ of
    those of the fit with it, with H = J (JᵀJ + σ²)⁻¹ Jᵀ of the state's rows: σ² keeps a parameter that only
    that state tells near what it may plausibly be, one spread about its default.

    Parameters
    ----------
    residuals : over their noise, (states, outputs).
    slopes : of these, by parameters over their plausible spread, (states · outputs, free).
    noise_scale : σ, what the noise is to be multiplied by.

    Returns
    -------
    residuals : (states, outputs), over their noise.

    References
    ----------
    Cook and Weisberg (1982), Residuals and influence in regression, section 2.2, for a group of rows.
    """
    states, outputs = residuals.shape
    if not slopes.shape[1]:
        return residuals
    by = slopes.reshape(states, outputs, -1)
    inverse = np.linalg.inv(slopes.T @ slopes + noise_scale**2 * np.eye(slopes.shape[1]))
    leverage = by @ inverse @ np.swapaxes(by, 1, 2)
    return np.linalg.solve(np.eye(outputs) - leverage, residuals[..., None])[..., 0]


def angle_errors(held_out: np.ndarray, angle: np.ndarray, measured: Measured, length: float) -> np.ndarray:
    """Errors of the bending angle of states left out of the fit, (states,) [rad]; measured, or by the tip.

    Where only the tip was measured, its error is taken for that of an arc's angle: a tip of an arc of the
    length L moves by L |d(e^{iθ} − 1)/(iθ)|/dθ for each radian.

    Parameters
    ----------
    held_out : residuals of `held_out` in units [rad, m].
    angle : predicted bending angle [rad].
    measured : the states.
    length : of the body that bends [m].

    Raises
    ------
    ValueError
        Where neither the angle nor all three coordinates of the tip were measured.
    """
    names = measured.outputs
    if ANGLE in names:
        return np.abs(held_out[:, names.index(ANGLE)])
    if not all(name in names for name in POSITIONS):
        raise ValueError(f"got {', '.join(names)}, expected {ANGLE}, or all of {', '.join(POSITIONS)}")
    off = np.linalg.norm(held_out[:, [names.index(name) for name in POSITIONS]], axis=1)
    theta = np.maximum(np.abs(angle), 1e-3)
    way = np.abs((np.exp(1j * theta) * (1j * theta - 1.0) + 1.0) / theta**2)
    return np.asarray(off / (length * way))


def error_figures(errors: np.ndarray) -> dict[str, float | int]:
    """Median, 90 % bound and worst of some errors, as calibration files have them."""
    return {
        "median": float(np.median(errors)),
        "p90": float(np.percentile(errors, 90, method="higher")),
        "worst": float(errors.max()),
        "rms": math.sqrt(float(np.mean(errors**2))),
        "states": len(errors),
    }
