"""States of a dataset as plain arrays, and the metric of their residuals in a fit."""

from dataclasses import dataclass, fields

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float

from calibration.fit.upright import leaned_over, stood_upright

Floats = Float[np.ndarray, "..."]

# Volume error that weighs as much as one degree of bending angle, relative to the volume's range.
VOLUME_TOLERANCE = 0.01
# Lower bound of stiffness in the metric, relative to the median: states close to a snap would dominate.
SOFT_LIMIT = 0.25


@dataclass(frozen=True)
class Samples:
    """States, one per row: pressure [Pa], curvature [1/m], gradient (m, −V) [N m, m²] and Hessian of Π [SI].

    ψ [rad] is NaN if the winding has no orientation.
    """

    pressure: Float[np.ndarray, "n 3"]
    curvature: Float[np.ndarray, "n 3"]
    energy: Float[np.ndarray, " n"]
    gradient: Float[np.ndarray, "n 6"]
    hessian: Float[np.ndarray, "n 6 6"]
    psi: Float[np.ndarray, " n"]
    path: np.ndarray
    held_out: Bool[np.ndarray, " n"]

    @property
    def moment(self) -> Float[np.ndarray, "n 3"]:
        """Moment on the section [N m]."""
        return self.gradient[:, :3]

    @property
    def volume(self) -> Float[np.ndarray, "n 3"]:
        """Chamber volumes per length [m²]."""
        return -self.gradient[:, 3:]

    def __len__(self) -> int:
        return len(self.energy)

    def where(self, keep: Bool[np.ndarray, " n"]) -> "Samples":
        """Return the states for which `keep` is true."""
        return Samples(**{field.name: getattr(self, field.name)[keep] for field in fields(self)})


def loading_samples(dataset: xr.Dataset) -> Samples:
    """Return the states on the loading branch: those of each path before it becomes unstable or jumps.

    A real section is never at an unstable state, and after a jump the same loads have another solution.
    Sections that give way sideways are made to stand, see `stood_upright`; those that lean over though they
    are held have left the branch too, see `leaned_over`.
    """
    gradient, hessian = stood_upright(
        np.concatenate([dataset["moment"].values, -dataset["volume"].values], axis=1),
        dataset["hessian"].values,
        dataset["applied_moment"].values,
        dataset["held"].values != 0,
        dataset["curvature"].values,
    )
    everything = Samples(
        pressure=dataset["pressure"].values,
        curvature=dataset["curvature"].values,
        energy=dataset["energy"].values,
        gradient=gradient,
        hessian=hessian,
        psi=dataset["psi"].values,
        path=dataset["path"].values,
        held_out=dataset["role"].values == "held-out",
    )
    leaned = leaned_over(dataset["hessian"].values, dataset["held"].values != 0, everything.path)
    return everything.where(on_loading_branch(dataset, everything.path) & ~leaned)


def on_loading_branch(dataset: xr.Dataset, path: np.ndarray) -> Bool[np.ndarray, " states"]:
    """Return which states come before the first unstable or jumped state of their path."""
    left = (dataset["stable"].values == 0) | (dataset["jumped"].values != 0)
    gone = np.zeros(len(left), dtype=bool)
    for name in np.unique(path):
        gone[path == name] = np.maximum.accumulate(left[path == name])
    return ~gone


@dataclass(frozen=True)
class Metric:
    """Metric of a law's errors, in degrees of bending angle and hundredths of the volume's range.

    A moment error δm is converted to the angle error L |K⁻¹ δm| that it causes in free bending, with K the
    stiffness of the state. A Hessian error δH is converted to the gradient error δH δy at a neighbouring
    state, a small step δy away.

    Attributes
    ----------
    gradient : matrix of each state that converts a gradient error to these units.
    step : step δy in each component of (u, p) [1/m, Pa].
    """

    gradient: Float[np.ndarray, "n 6 6"]
    step: Float[np.ndarray, "6"]


def metric(samples: Samples, length: float, pressure_step: float, moment_step: float) -> Metric:
    """Return the metric of the residuals at some states.

    Parameters
    ----------
    samples : states.
    length : body length for the bending angle [m].
    pressure_step, moment_step : steps in which a state's Hessian predicts the gradient [Pa], [N m].
    """
    stiffness = samples.hessian[:, :3, :3]
    gradient = np.zeros((len(samples), 6, 6))
    gradient[:, :3, :3] = np.rad2deg(length) * compliances(stiffness)
    gradient[:, 3:, 3:] = np.eye(3) / (VOLUME_TOLERANCE * np.ptp(samples.volume))
    typical = float(np.median(np.linalg.eigvalsh(stiffness)))
    return Metric(gradient, np.array([moment_step / typical] * 3 + [pressure_step] * 3))


def softness(samples: Samples) -> Float[np.ndarray, " n"]:
    """Return the least stiffness of each state, relative to the median of all stiffnesses."""
    value = np.linalg.eigvalsh(samples.hessian[:, :3, :3])
    return value[:, 0] / float(np.median(value))


def compliances(stiffness: Float[np.ndarray, "n 3 3"]) -> Float[np.ndarray, "n 3 3"]:
    """Return each state's compliance [1/(N m²)], with stiffnesses of at least `SOFT_LIMIT` of the median."""
    value, frame = np.linalg.eigh(stiffness)
    value = np.maximum(value, SOFT_LIMIT * np.median(value))
    return np.einsum("nij,nj,nkj->nik", frame, 1.0 / value, frame)
