"""A section law as the core takes it: constant arrays, with the images of its symmetry written out."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rodmodel.io import SIGNS, TURNS, biases_at, placed_images, symmetric

if TYPE_CHECKING:
    from rodmodel.io import RidgeArrays

#: The ridges of one image are padded with ridges of zero weight to a multiple of this.
LANES = 8


@dataclass(frozen=True)
class LawData:
    """Arrays and numbers of `rm_law` and `rm_oriented`, which rodmodel_core.h describes."""

    numbers: dict[str, float]
    sizes: dict[str, int]
    arrays: dict[str, np.ndarray]
    orders: np.ndarray
    orientation: dict[str, np.ndarray]
    """Arrays of a law of all orientations; empty for any other law."""


def law_data(
    law: "RidgeArrays",
    turns: int = 0,
    mirrored: bool = False,
    psi: float | None = None,
    biases: np.ndarray | None = None,
) -> LawData:
    """Prepare a calibration's law for the core.

    Parameters
    ----------
    law : section law of a calibration.
    turns : turn of the rod's winding from the law's, in units of 120°.
    mirrored : whether the winding is the mirror image y → −y of the law's, before the turn.
    psi : orientation for a law of all orientations [rad]; None leaves it to `rm_orient`.
    biases : biases w of each image, (images, features), which replace the law's.
    """
    placed = placed_images(law.symmetry, turns, mirrored)
    share = 1.0 / len(placed)
    given = law.feature_biases if biases is None else biases
    if law.orientation_weights is not None and psi is not None:
        given = biases_at(given, law.orientation_weights, psi)
    biases = np.broadcast_to(given, (len(placed), law.feature_biases.size))
    # Only a law without symmetry has rest pressures, so its single image needs no reordering.
    straight = np.zeros(3) if law.rest_pressures is None else law.rest_pressures
    rest = np.tanh(biases + law.feature_weights @ straight)

    lower = np.zeros((3, 3))
    lower[np.tril_indices(3)] = law.factor
    slope, quadratic = np.zeros(3), np.zeros((3, 3))
    constant = float(straight.sum()) * law.pressure_scale * law.rest_volume / law.energy_scale
    if law.quadratic is not None:
        axes = placed[0][0]
        quadratic += axes.T @ symmetric(law.quadratic) @ axes
    for (axes, _), features in zip(placed, rest, strict=True):
        z = law.mixing @ np.concatenate([straight, features]) + law.offsets
        constant -= share * float(law.weights @ _ridge(z) + law.slopes[:3] @ straight)
        slope -= share * (law.weights * (1.0 + z * z) ** -2) @ law.directions @ axes
        quadratic += share * (axes.T @ lower) @ (axes.T @ lower).T

    feature_weights, mixing, slopes = law.feature_weights, law.mixing, law.slopes
    guess = np.stack([axes.T @ law.guess for axes, _ in placed])
    if straight.any():
        # The guess is linear in q − q₀, but the core has q: one more feature, changing by 1, carries −q₀.
        feature_weights = np.pad(feature_weights, [(0, 1), (0, 0)])
        biases, mixing, slopes = (
            np.pad(a, [*[(0, 0)] * (a.ndim - 1), (0, 1)]) for a in (biases, mixing, slopes)
        )
        rest = np.pad(rest, [(0, 0), (0, 1)], constant_values=-1.0)
        guess = np.concatenate([guess, -guess[:, :, :3] @ straight[:, None]], axis=2)

    padding = -law.offsets.size % LANES
    columns = [(0, 0), (0, padding)]
    directions = np.concatenate([np.pad((law.directions @ axes).T, columns) for axes, _ in placed], axis=1)
    weights = np.pad(share * law.weights, (0, padding))
    return LawData(
        numbers={
            "pressure_scale": law.pressure_scale,
            "curvature_scale": law.curvature_scale,
            "energy_scale": law.energy_scale,
            "rest_volume": law.rest_volume,
            "constant": constant,
        },
        sizes={
            "images": len(placed),
            "ridges": law.offsets.size + padding,
            "features": len(feature_weights),
        },
        arrays={
            "slope": slope,
            "quadratic": quadratic[np.triu_indices(3)],
            "slope_by_pressure": np.zeros(9),
            "pressure_quadratic": np.zeros(9),
            "feature_weights": feature_weights,
            "feature_biases": biases,
            "rest_features": rest,
            "mixing": np.pad(mixing.T, columns),
            "offsets": np.pad(law.offsets, (0, padding)),
            "weights": np.tile(weights, len(placed)),
            "directions": directions,
            "slopes": share * slopes,
            "guess": share * guess,
        },
        orders=np.stack([chambers for _, chambers in placed]).astype(np.int32),
        orientation={}
        if law.orientation_weights is None or psi is not None
        else {
            "shared_biases": law.feature_biases,
            "orientation_weights": law.orientation_weights,
            "image_signs": SIGNS,
            "image_turns": TURNS,
            "image_axes": np.stack([axes for axes, _ in placed]),
            "bare_directions": np.pad(law.directions.T, columns),
            "bare_weights": weights,
        },
    )


def linear_law_data(stiffness: np.ndarray, curvature_by_pressure: np.ndarray, rest_volume: float) -> LawData:
    """Prepare the linear law Π = ½ (u − C p)ᵀ K (u − C p) − V₀ Σ p for the core; it has no ridges.

    Parameters
    ----------
    stiffness : K, (3, 3) [N m²].
    curvature_by_pressure : C, (3, 3) [1/(m Pa)].
    rest_volume : V₀ [m²].
    """
    by_pressure = stiffness @ curvature_by_pressure
    empty = np.zeros(0)
    return LawData(
        numbers={
            "pressure_scale": 1.0,
            "curvature_scale": 1.0,
            "energy_scale": 1.0,
            "rest_volume": rest_volume,
            "constant": 0.0,
        },
        sizes={"images": 1, "ridges": 0, "features": 0},
        arrays={
            "slope": np.zeros(3),
            "quadratic": stiffness[np.triu_indices(3)],
            "slope_by_pressure": -by_pressure.T.ravel(),
            "pressure_quadratic": (curvature_by_pressure.T @ by_pressure).ravel(),
            **dict.fromkeys(
                ("feature_weights", "feature_biases", "rest_features", "mixing", "offsets", "weights"),
                empty,
            ),
            "directions": empty,
            "slopes": np.zeros(3),
            "guess": curvature_by_pressure[None],
        },
        orders=np.arange(3, dtype=np.int32)[None],
        orientation={},
    )


def _ridge(z: np.ndarray) -> np.ndarray:
    return 0.5 * (z / (1.0 + z * z) + np.arctan(z))
