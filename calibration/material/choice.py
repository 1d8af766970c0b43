"""Choice of a law for material tests, by the error on rows that its fit has not seen.

The rows are cut into blocks along the stretch. Each block is left out once, and the laws are fitted to the
others: a law with too many constants swings where rows are missing. The law with the fewest constants is
chosen of those whose squared held-out errors exceed the least, block by block, by no more than one standard
error of the difference, or by (half a per cent)² of the stress.

References
----------
Hastie, Tibshirani, Friedman (2009), The Elements of Statistical Learning, 2nd ed., §7.10: cross-validation
and the one-standard-error rule.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.material.candidates import CANDIDATES, Candidate
from calibration.material.machine_file import MaterialTest
from calibration.material.points import Points, points_of, stress_at_rest
from calibration.material.rounded import rounded
from fem_reference.materials import Material

_BLOCKS = 8
# A fit is in doubt beyond this error, on its own rows and on others, and below these numbers.
_LARGEST_ERROR, _LARGEST_HELD_OUT = 0.06, 0.15
_FEWEST_ROWS, _LEAST_STRETCH = 5, 1.2
# An error this small besides that of the best law does not matter.
_ALIKE = 0.005
# Stress at rest from which it is said, in standard errors, and over the largest of its test.
_TOLD, _AT_REST = 3.0, 0.005


class MaterialFitError(ArithmeticError):
    """Error for tests that no stable law fits."""


@dataclass(frozen=True)
class FittedLaw:
    """A candidate after the fit.

    Parameters
    ----------
    name, constants : of the candidate.
    material : fitted law, or None.
    why_not : why there is none.
    error, largest : root mean square and largest error, each over the stress that it is compared with.
    held_out : root mean square error on rows left out of the fit; infinite where that is not known.
    squares : squares of the errors of each block of rows left out, whose mean is that of `held_out`.
    """

    name: str
    constants: int
    material: Material | None
    why_not: str = ""
    error: float = math.inf
    largest: float = math.inf
    held_out: float = math.inf
    squares: tuple[float, ...] = ()


@dataclass(frozen=True)
class MaterialFit:
    """Laws fitted to tests.

    Parameters
    ----------
    tests, points : what was fitted.
    laws : all candidates.
    chosen : of them.
    notes : what a user should know.
    doubts : why the chosen law should not be used.
    """

    tests: tuple[MaterialTest, ...]
    points: Points
    laws: tuple[FittedLaw, ...]
    chosen: FittedLaw
    notes: tuple[str, ...]
    doubts: tuple[str, ...]

    @property
    def material(self) -> Material:
        """The chosen law."""
        assert self.chosen.material is not None
        return self.chosen.material

    @property
    def source(self) -> str:
        """Where the constants are from, in one line."""
        tests = ", ".join(f"{test.name} ({test.mode})" for test in self.tests)
        return f"{self.chosen.name} fitted to {tests}"


def fit_material(tests: Sequence[MaterialTest]) -> MaterialFit:
    """Fit all candidates to tests, and choose one.

    Raises
    ------
    MaterialFitError
        If no law is stable over the tested stretch.
    """
    points = points_of(tests)
    blocks = _blocks(points)
    laws = tuple(_fitted(candidate, points, blocks) for candidate in CANDIDATES)
    best = min(laws, key=lambda law: law.held_out)
    if not math.isfinite(best.held_out):
        raise MaterialFitError("no law is stable by Drucker over the tested stretch")
    most = max(law.held_out for law in laws if math.isfinite(law.held_out) and _alike(law, best))
    near = [law for law in laws if law.held_out <= most]
    chosen = min(near, key=lambda law: (law.constants, law.held_out))
    return MaterialFit(tuple(tests), points, laws, chosen, _notes(tests), _doubts(points, chosen))


def _alike(law: FittedLaw, best: FittedLaw) -> bool:
    """Whether a law's held-out error is as good as the best one's."""
    more = np.subtract(law.squares, best.squares)
    return bool(more.mean() <= max(more.std(ddof=1) / math.sqrt(len(more)), _ALIKE**2))


def _blocks(points: Points) -> list[np.ndarray]:
    """Return the rows of each block, neighbours in stretch."""
    return np.array_split(np.argsort(points.stretch, kind="stable"), min(_BLOCKS, len(points)))


def _fitted(candidate: Candidate, points: Points, blocks: list[np.ndarray]) -> FittedLaw:
    """Return a candidate fitted to all rows, with its error on left-out ones."""
    if candidate.constants > len(points) - max(len(block) for block in blocks):
        return FittedLaw(candidate.name, candidate.constants, None, "too few rows")
    try:
        material = rounded(candidate.fit(points))
    except ValueError as error:
        return FittedLaw(candidate.name, candidate.constants, None, str(error))
    squares = []
    for block in blocks:
        others = np.setdiff1d(np.arange(len(points)), block)
        try:
            squares.append(points.of(block).root_mean_square(candidate.fit(points.of(others))) ** 2)
        except ValueError:
            squares.append(math.inf)
    share = np.array([points.weight[block].sum() for block in blocks])
    squares_of_blocks = tuple(float(s) for s in np.array(squares) * share * len(blocks))
    held_out = math.sqrt(sum(squares_of_blocks) / len(blocks))
    return FittedLaw(
        candidate.name,
        candidate.constants,
        material,
        "",
        points.root_mean_square(material),
        float(np.abs(points.error(material)).max()),
        held_out,
        squares_of_blocks,
    )


def _notes(tests: Sequence[MaterialTest]) -> tuple[str, ...]:
    notes = [f"{test.name}: left out {what}" for test in tests for what in test.passed_over]
    for test in tests:
        rest, error = stress_at_rest(test.stretch, test.stress)
        if abs(rest) > max(_TOLD * error, _AT_REST * float(np.abs(test.stress).max())):
            notes.append(
                f"{test.name}: its stress at rest is {rest / 1e3:.2g} kPa, so small stresses count less; "
                "zero the load cell before a test"
            )
    if {test.mode for test in tests} == {"uniaxial"}:
        notes.append("uniaxial tests alone do not tell the stress under biaxial stretch")
    return tuple(notes)


def _doubts(points: Points, chosen: FittedLaw) -> tuple[str, ...]:
    doubts = []
    if len(points) < _FEWEST_ROWS:
        doubts.append(f"{len(points)} rows are few; expected at least {_FEWEST_ROWS}")
    least, most = points.stretch_range
    if max(most, 1.0 / least) < _LEAST_STRETCH:
        doubts.append(
            f"the tests go from a stretch of {least:.3g} to {most:.3g}, expected at least {_LEAST_STRETCH:g}"
        )
    if chosen.error > _LARGEST_ERROR:
        doubts.append(
            f"the law is off by {100.0 * chosen.error:.1f} % in root mean square, expected at most "
            f"{100.0 * _LARGEST_ERROR:g} %"
        )
    if chosen.held_out > _LARGEST_HELD_OUT:
        doubts.append(
            f"rows left out of the fit are off by {100.0 * chosen.held_out:.0f} % in root mean square, "
            f"expected at most {100.0 * _LARGEST_HELD_OUT:g} %"
        )
    return tuple(doubts)
