"""A section law as NumPy arrays, as a calibration file holds it."""

import math
from dataclasses import dataclass, fields
from typing import final

import numpy as np

#: Number of images of a state under each symmetry of a section.
IMAGES = {"none": 1, "mirror": 2, "full": 6}
#: Largest number of ridges of all images.
MOST_RIDGES = 4096
#: Largest number of hidden features.
MOST_FEATURES = 1024

_SCALES = ("pressure_scale", "curvature_scale", "energy_scale", "rest_volume")


@final
@dataclass(frozen=True, eq=False)
class RidgeArrays:
    """Ridge network Π(u, p) as plain arrays; `rodmodel.RidgeNetwork` has the formula.

    Attributes
    ----------
    feature_weights : W, (features, 3).
    feature_biases : w, (features,).
    directions : d, (ridges, 3).
    mixing : e, (ridges, 3 + features).
    offsets, weights : b and c, (ridges,).
    factor : lower triangle of L by rows, entries 11, 21, 22, 31, 32, 33: (6,).
    slopes : v, (3 + features,).
    guess : G/u_s, (3, 3 + features).
    pressure_scale : p_s [Pa].
    curvature_scale : u_s [1/m].
    energy_scale : E [J/m].
    rest_volume : V₀, chamber volume per length at rest [m²].
    symmetry : symmetry of the section: ``none``, ``mirror`` (y → −y), or ``full`` (with turns by 120° too).
    orientation_weights : V, (features, 2), of a law of all orientations ψ, which has ``full`` symmetry; None
        for a law of one orientation.
    rest_pressures : q₀ = p₀/p_s, at which the section is straight without moment, (3,); None for zeros. Only
        a law adjusted to an individual actuator, which has no symmetry, has this and `quadratic`.
    quadratic : A₀, lower triangle by rows as in `factor`, (6,), added to L Lᵀ; None for zeros.

    Raises
    ------
    ValueError
        If array sizes disagree, a number is not finite, or the law is too large.
    """

    feature_weights: np.ndarray
    feature_biases: np.ndarray
    directions: np.ndarray
    mixing: np.ndarray
    offsets: np.ndarray
    weights: np.ndarray
    factor: np.ndarray
    slopes: np.ndarray
    guess: np.ndarray
    pressure_scale: float
    curvature_scale: float
    energy_scale: float
    rest_volume: float
    symmetry: str = "none"
    orientation_weights: np.ndarray | None = None
    rest_pressures: np.ndarray | None = None
    quadratic: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Store the arrays as read-only doubles, and refuse those that do not fit together."""
        for name in ARRAYS:
            value = getattr(self, name)
            if value is not None:
                array = np.array(value, np.float64, order="C")
                array.flags.writeable = False
                object.__setattr__(self, name, array)
        for name in _SCALES:
            object.__setattr__(self, name, float(getattr(self, name)))
        self._check_symmetry()
        self._check_shapes()
        self._check_numbers()

    @property
    def features(self) -> int:
        """Number of hidden features, functions of the pressures."""
        return len(self.feature_biases)

    @property
    def ridges(self) -> int:
        """Number of ridges of one image."""
        return len(self.offsets)

    @property
    def images(self) -> int:
        """Number of images of a state under the symmetry, the state itself included."""
        return IMAGES[self.symmetry]

    @property
    def is_oriented(self) -> bool:
        """Whether this is a law of all orientations ψ."""
        return self.orientation_weights is not None

    @property
    def is_adjusted(self) -> bool:
        """Whether the law is adjusted to an individual actuator, whose chambers differ."""
        return self.rest_pressures is not None or self.quadratic is not None

    def _check_symmetry(self) -> None:
        if self.symmetry not in IMAGES:
            raise ValueError(f"symmetry: got {self.symmetry!r}, expected one of {', '.join(IMAGES)}")
        if self.is_oriented and self.symmetry != "full":
            raise ValueError(f"symmetry: got {self.symmetry!r}, expected full in a law of all orientations")
        if self.is_adjusted and self.symmetry != "none":
            raise ValueError(f"symmetry: got {self.symmetry!r}, expected none in an adjusted law")

    def _check_shapes(self) -> None:
        for name in ("feature_biases", "offsets"):
            if getattr(self, name).ndim != 1:
                raise ValueError(f"{name}: got shape {getattr(self, name).shape}, expected a vector")
        features, ridges = self.features, self.ridges
        expected = {
            "feature_weights": (features, 3),
            "directions": (ridges, 3),
            "mixing": (ridges, 3 + features),
            "weights": (ridges,),
            "factor": (6,),
            "slopes": (3 + features,),
            "guess": (3, 3 + features),
            "orientation_weights": (features, 2),
            "rest_pressures": (3,),
            "quadratic": (6,),
        }
        for name, shape in expected.items():
            array = getattr(self, name)
            if array is not None and array.shape != shape:
                raise ValueError(
                    f"{name}: got shape {array.shape}, expected {shape} with {features} features and "
                    f"{ridges} ridges"
                )
        if not 1 <= ridges * self.images <= MOST_RIDGES:
            raise ValueError(
                f"offsets: got {ridges} ridges of {self.images} images, expected 1 to {MOST_RIDGES} "
                "altogether"
            )
        if not 1 <= features <= MOST_FEATURES:
            raise ValueError(f"feature_biases: got {features} features, expected 1 to {MOST_FEATURES}")

    def _check_numbers(self) -> None:
        for name in ARRAYS:
            array = getattr(self, name)
            if array is not None and not np.all(np.isfinite(array)):
                raise ValueError(f"{name}: got a value that is not finite, expected finite numbers")
        for name in _SCALES:
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name}: got {value}, expected a positive number")


#: Names of the arrays, in the order of the file.
ARRAYS = tuple(field.name for field in fields(RidgeArrays) if field.name not in (*_SCALES, "symmetry"))
