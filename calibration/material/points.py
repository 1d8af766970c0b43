"""Rows of material tests, with what each counts in a fit."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from calibration.material.machine_file import MaterialTest
from fem_reference.materials import Material, principal_stretches

#: Stresses are compared with themselves, and small ones with this share of the test's median.
FLOOR = 0.03
# Up to this strain, the stresses of at least so many rows tell the stress at rest.
_SMALL_STRAIN, _FEWEST_SMALL = 0.3, 8
# An error of that stress is as bad as a relative error of this share.
_AS_BAD = 0.2
# Rows of a test beyond which neighbours are averaged.
_MOST_ROWS = 200


@dataclass(frozen=True)
class Points:
    """Rows of all tests.

    Parameters
    ----------
    principal : principal stretches.
    stretch : λ of the stretched direction.
    stress : nominal stress [Pa].
    scale : stress that an error is compared with [Pa].
    weight : of an error's square; one in sum over all tests.
    test : number of the row's test.
    """

    principal: Float[np.ndarray, "rows 3"]
    stretch: Float[np.ndarray, " rows"]
    stress: Float[np.ndarray, " rows"]
    scale: Float[np.ndarray, " rows"]
    weight: Float[np.ndarray, " rows"]
    test: Int[np.ndarray, " rows"]

    def __len__(self) -> int:
        return len(self.stretch)

    @property
    def stretch_range(self) -> tuple[float, float]:
        """Least and largest stretch, with one between them."""
        return min(1.0, float(self.stretch.min())), max(1.0, float(self.stretch.max()))

    def of(self, rows: Int[np.ndarray, " fewer"]) -> "Points":
        """Return some of the rows."""
        parts = (self.principal, self.stretch, self.stress, self.scale, self.weight, self.test)
        return Points(*(part[rows] for part in parts))

    def error(self, material: Material) -> Float[np.ndarray, " rows"]:
        """Return errors of the law's stress over `scale`."""
        slope = material.slope(self.principal)
        return ((slope[:, 0] - slope[:, 2]) / self.stretch - self.stress) / self.scale

    def root_mean_square(self, material: Material) -> float:
        """Return the weighted root mean square of `error`."""
        return float(np.sqrt(np.average(self.error(material) ** 2, weights=self.weight)))


def points_of(tests: Sequence[MaterialTest]) -> Points:
    """Return the rows of tests.

    Each test counts alike. Within a test, half of the weight goes by the number of rows and half by the
    strain that they span, so that neither a slow part of the test nor a single row decides. An error is
    relative, down to `FLOOR` of the median stress, and to five times the stress that the test has at rest.
    """
    parts: list[list[np.ndarray]] = [[] for _ in range(6)]
    for number, test in enumerate(tests):
        stretch, stress = _averaged(test.stretch, test.stress)
        span = np.gradient(np.log(stretch))
        least = max(
            FLOOR * float(np.median(np.abs(stress))), abs(stress_at_rest(stretch, stress)[0]) / _AS_BAD
        )
        own = (
            principal_stretches(test.mode, stretch),
            stretch,
            stress,
            np.hypot(stress, least),
            0.5 * (span / span.sum() + 1.0 / len(stretch)) / len(tests),
            np.full(len(stretch), number),
        )
        for part, values in zip(parts, own, strict=True):
            part.append(values)
    return Points(*(np.concatenate(part) for part in parts))


def stress_at_rest(
    stretch: Float[np.ndarray, " rows"], stress: Float[np.ndarray, " rows"]
) -> tuple[float, float]:
    """Return the stress that a test has at rest, as of a load cell that was not at zero, and its error [Pa].

    It is extrapolated from small strains; zero where there are too few.
    """
    strain = np.log(stretch)
    small = np.abs(strain) < _SMALL_STRAIN
    if small.sum() < _FEWEST_SMALL:
        return 0.0, 0.0
    matrix = np.vander(strain[small], 3)
    found, squares, *_ = np.linalg.lstsq(matrix, stress[small])
    variance = float(squares.sum()) / (small.sum() - 3) * np.linalg.inv(matrix.T @ matrix)[2, 2]
    return float(found[2]), math.sqrt(variance)


def _averaged(
    stretch: Float[np.ndarray, " rows"], stress: Float[np.ndarray, " rows"]
) -> tuple[Float[np.ndarray, " fewer"], Float[np.ndarray, " fewer"]]:
    """Return rows in the order of their stretch, neighbours averaged where they are many."""
    order = np.argsort(stretch, kind="stable")
    strain, stress = np.log(stretch[order]), stress[order]
    if len(strain) > _MOST_ROWS:
        place = _MOST_ROWS * (strain - strain[0]) / (strain[-1] - strain[0])
        place = np.minimum(place.astype(int), _MOST_ROWS - 1)
        count = np.bincount(place)
        filled = count > 0
        strain, stress = (np.bincount(place, values)[filled] / count[filled] for values in (strain, stress))
    return np.exp(strain), stress
