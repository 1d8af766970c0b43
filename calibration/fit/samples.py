"""States of a dataset as plain arrays, and the scales in which a fit weighs their residuals."""

from dataclasses import dataclass, fields

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float

Floats = Float[np.ndarray, "..."]

VOLUME_TOLERANCE = 0.01  # of the volume's range, weighs as much as one degree of bending angle
SOFT_LIMIT = 0.25  # of the median stiffness; a state near its snap would else outweigh all others


@dataclass(frozen=True)
class Samples:
    """States, one a row: pressure [Pa], curvature [1/m], gradient (m, −V) [N m, m²] and Hessian of Π (SI).

    ψ [rad] is not a number where the winding has none.
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
        """The states for which `keep` holds."""
        return Samples(**{field.name: getattr(self, field.name)[keep] for field in fields(self)})


def loading_samples(dataset: xr.Dataset) -> Samples:
    """States of a dataset on the loading branch: of each path, those before it loses its stability or jumps.

    No section is found at an unstable state; and behind a jump the same loads have another answer.
    """
    everything = Samples(
        pressure=dataset["pressure"].values,
        curvature=dataset["curvature"].values,
        energy=dataset["energy"].values,
        gradient=np.concatenate([dataset["moment"].values, -dataset["volume"].values], axis=1),
        hessian=dataset["hessian"].values,
        psi=dataset["psi"].values,
        path=dataset["path"].values,
        held_out=dataset["role"].values == "held-out",
    )
    return everything.where(on_loading_branch(dataset, everything.path))


def on_loading_branch(dataset: xr.Dataset, path: np.ndarray) -> Bool[np.ndarray, " states"]:
    """Which states come before the first of their path that has jumped or is known to be unstable."""
    left = (dataset["stable"].values == 0) | (dataset["jumped"].values != 0)
    gone = np.zeros(len(left), dtype=bool)
    for name in np.unique(path):
        gone[path == name] = np.maximum.accumulate(left[path == name])
    return ~gone


@dataclass(frozen=True)
class Metric:
    """How far a law is from the states, in degrees of bending angle and hundredths of the volume's range.

    A moment error δm counts as the angle error L |K⁻¹ δm| that it causes in free bending, K the state's own
    stiffness. A Hessian error δH counts as the gradient error δH δy that it causes at a neighbouring state,
    a small step δy away.

    Attributes
    ----------
    gradient : matrix of each state that turns a gradient error into these units.
    step : that step in each of (u, p) [1/m, Pa].
    """

    gradient: Float[np.ndarray, "n 6 6"]
    step: Float[np.ndarray, "6"]


def metric(samples: Samples, length: float, pressure_step: float, moment_step: float) -> Metric:
    """Scales of the residuals of some states.

    Parameters
    ----------
    samples : the states.
    length : of the body whose bending angle counts [m].
    pressure_step, moment_step : how far around a state its Hessian is to tell the slopes [Pa], [N m].
    """
    stiffness = samples.hessian[:, :3, :3]
    gradient = np.zeros((len(samples), 6, 6))
    gradient[:, :3, :3] = np.rad2deg(length) * compliances(stiffness)
    gradient[:, 3:, 3:] = np.eye(3) / (VOLUME_TOLERANCE * np.ptp(samples.volume))
    typical = float(np.median(np.linalg.eigvalsh(stiffness)))
    return Metric(gradient, np.array([moment_step / typical] * 3 + [pressure_step] * 3))


def softness(samples: Samples) -> Float[np.ndarray, " n"]:
    """Stiffness of each state in its softest direction, over the median of all stiffnesses."""
    value = np.linalg.eigvalsh(samples.hessian[:, :3, :3])
    return value[:, 0] / float(np.median(value))


def compliances(stiffness: Float[np.ndarray, "n 3 3"]) -> Float[np.ndarray, "n 3 3"]:
    """Inverse stiffness of each state [1/(N m²)], none softer than a quarter of the median section."""
    value, frame = np.linalg.eigh(stiffness)
    value = np.maximum(value, SOFT_LIMIT * np.median(value))
    return np.einsum("nij,nj,nkj->nik", frame, 1.0 / value, frame)
