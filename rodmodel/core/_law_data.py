"""A section law as the core takes it: constant arrays, the images of its symmetry worked out."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rodmodel.io import RidgeArrays

#: Ridges of one image are a multiple of this, filled with ridges of no weight.
LANES = 8

_THIRD = 2.0 * math.pi / 3.0
_MIRROR = np.diag([-1.0, 1.0, -1.0])  # of curvatures, y → −y
_SWAPPED = np.array([0, 2, 1])  # chambers in the mirror


@dataclass(frozen=True)
class LawData:
    """Arrays and numbers of `rm_law` and `rm_oriented`; their header says what each is."""

    numbers: dict[str, float]
    sizes: dict[str, int]
    arrays: dict[str, np.ndarray]
    orders: np.ndarray
    orientation: dict[str, np.ndarray]
    """Empty but for a law of all orientations."""


def turn_matrix(turns: int) -> np.ndarray:
    """Components in axes turned by 120° · `turns` from those in the given axes, R_z(−120° turns)."""
    angle = turns * _THIRD
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def images_of(symmetry: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Images (U u, p[order]) of a state at which the potential is the same: each U and order."""
    turned = [(turn_matrix(turns), np.roll(np.arange(3), -turns)) for turns in range(3)]
    if symmetry == "none":
        return turned[:1]
    if symmetry == "mirror":
        return [turned[0], (_MIRROR, _SWAPPED)]
    return [*turned, *((_MIRROR @ turn, order[_SWAPPED]) for turn, order in turned)]


def law_data(
    law: "RidgeArrays",
    turns: int = 0,
    mirrored: bool = False,
    psi: float | None = None,
    biases: np.ndarray | None = None,
) -> LawData:
    """Work a calibration's law out for the core.

    Parameters
    ----------
    law : of a calibration.
    turns : by how many times 120° the rod's winding lies further round than the law's.
    mirrored : whether the winding is the mirror image y → −y of the law's; the turn comes after it.
    psi : orientation [rad] of a law of all; None leaves ψ to `rm_orient`, of such a law.
    biases : w of each image, (images, features), in place of the law's: of an orientation that is known
        already.
    """
    images = images_of(law.symmetry)
    signs, own_turns = np.repeat([1.0, -1.0], 3), np.tile(np.arange(3), 2) * _THIRD
    share = 1.0 / len(images)
    # What comes before the law: Q u, and the order in which it sees the pressures.
    seen, order = np.eye(3), np.arange(3)
    if mirrored:
        seen, order = _MIRROR, _SWAPPED
    seen, order = seen @ turn_matrix(turns), (order + turns) % 3
    placed = [(axes @ seen, order[chambers]) for axes, chambers in images]

    given = law.feature_biases if biases is None else biases
    biases = np.broadcast_to(given, (len(images), law.feature_biases.size))
    if law.orientation_weights is not None and psi is not None:
        twice = 2.0 * signs * (psi - own_turns)
        biases = biases + np.stack([np.cos(twice), np.sin(twice)], axis=1) @ law.orientation_weights.T
    rest = np.tanh(biases)

    lower = np.zeros((3, 3))
    lower[np.tril_indices(3)] = law.factor
    constant, slope, quadratic = 0.0, np.zeros(3), np.zeros((3, 3))
    for (axes, _), features in zip(placed, rest, strict=True):
        z = law.mixing[:, 3:] @ features + law.offsets
        constant -= share * float(law.weights @ _ridge(z))
        slope -= share * (law.weights * (1.0 + z * z) ** -2) @ law.directions @ axes
        quadratic += share * (axes.T @ lower) @ (axes.T @ lower).T

    empty = -law.offsets.size % LANES
    wide = [(0, 0), (0, empty)]
    directions = np.concatenate([np.pad((law.directions @ axes).T, wide) for axes, _ in placed], axis=1)
    weights = np.pad(share * law.weights, (0, empty))
    return LawData(
        numbers={
            "pressure_scale": law.pressure_scale,
            "curvature_scale": law.curvature_scale,
            "energy_scale": law.energy_scale,
            "rest_volume": law.rest_volume,
            "constant": constant,
        },
        sizes={
            "images": len(images),
            "ridges": law.offsets.size + empty,
            "features": law.feature_biases.size,
        },
        arrays={
            "slope": slope,
            "quadratic": quadratic[np.triu_indices(3)],
            "slope_by_pressure": np.zeros(9),
            "pressure_quadratic": np.zeros(9),
            "feature_weights": law.feature_weights,
            "feature_biases": biases,
            "rest_features": rest,
            "mixing": np.pad(law.mixing.T, wide),
            "offsets": np.pad(law.offsets, (0, empty)),
            "weights": np.tile(weights, len(images)),
            "directions": directions,
            "slopes": share * law.slopes,
            "guess": np.stack([share * axes.T @ law.guess for axes, _ in placed]),
        },
        orders=np.stack([chambers for _, chambers in placed]).astype(np.int32),
        orientation={}
        if law.orientation_weights is None or psi is not None
        else {
            "shared_biases": law.feature_biases,
            "orientation_weights": law.orientation_weights,
            "image_signs": signs,
            "image_turns": own_turns,
            "image_axes": np.stack([axes for axes, _ in placed]),
            "bare_directions": np.pad(law.directions.T, wide),
            "bare_weights": weights,
        },
    )


def linear_law_data(stiffness: np.ndarray, curvature_by_pressure: np.ndarray, rest_volume: float) -> LawData:
    """Work the linear law Π = ½ (u − C p)ᵀ K (u − C p) − V₀ Σ p out for the core: no ridges at all.

    Parameters
    ----------
    stiffness : K, (3, 3) [N m²].
    curvature_by_pressure : C, (3, 3) [1/(m Pa)].
    rest_volume : V₀ [m²].
    """
    by_pressure = stiffness @ curvature_by_pressure
    nothing = np.zeros(0)
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
                nothing,
            ),
            "directions": nothing,
            "slopes": np.zeros(3),
            "guess": curvature_by_pressure[None],
        },
        orders=np.arange(3, dtype=np.int32)[None],
        orientation={},
    )


def _ridge(z: np.ndarray) -> np.ndarray:
    return 0.5 * (z / (1.0 + z * z) + np.arctan(z))
