"""Leave-one-out errors of an adjusted rod, without new fits."""

import math

import numpy as np

from calibration.measured.csv_file import ANGLE, POSITIONS, Measured


def held_out(residuals: np.ndarray, slopes: np.ndarray, noise_scale: float) -> np.ndarray:
    """Return the leave-one-out residuals of each state.

    In the model linearised at the minimum, the residuals of a left-out state are (1 − H)⁻¹ times those of the
    full fit, with the leverage H = J (JᵀJ + σ²)⁻¹ Jᵀ of the state's rows. σ² is a prior of one spread about
    the defaults, for parameters that only this state determines.

    Parameters
    ----------
    residuals : residuals over their noise, (states, outputs).
    slopes : derivatives of these by parameters over their spreads, (states · outputs, free).
    noise_scale : factor σ of the noise.

    Returns
    -------
    residuals : leave-one-out residuals over their noise, (states, outputs).

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
    """Return leave-one-out errors of the bending angle, (states,) [rad], from the angle or else from the tip.

    If only the tip was measured, its error is converted to the angle of an arc: the tip of an arc of length L
    moves by L |d(e^{iθ} − 1)/(iθ)|/dθ per radian.

    Parameters
    ----------
    held_out : leave-one-out residuals [rad, m].
    angle : predicted bending angle [rad].
    measured : measured states.
    length : length of the bending body [m].

    Raises
    ------
    ValueError
        If neither the angle nor all three coordinates of the tip were measured.
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
    """Return median, 90th percentile, worst and root mean square of errors for calibration files."""
    return {
        "median": float(np.median(errors)),
        "p90": float(np.percentile(errors, 90, method="higher")),
        "worst": float(errors.max()),
        "rms": math.sqrt(float(np.mean(errors**2))),
        "states": len(errors),
    }
