"""Candidate laws for a material test, each fitted by relative least squares.

All laws are linear in their constants. Only the exponents of Ogden terms are searched, with the moduli solved
for at each step (variable projection). Where the best constants are not stable by Drucker over the
tested stretch, the best stable ones take their place.

References
----------
Golub and Pereyra (1973), SIAM J. Numer. Anal. 10: variable projection. Ogden, Saccomandi, Sgura (2004),
Comput. Mech. 34: what least squares of hyperelastic laws can tell, and relative errors.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias, TypeVar

import numpy as np
from scipy.optimize import least_squares, minimize, nnls

from calibration.material.points import Points
from fem_reference.materials import (
    MODES,
    Material,
    Ogden,
    Yeoh,
    drucker_matrix,
    mooney_rivlin,
    neo_hookean,
    principal_stretches,
)

# Exponents that an Ogden fit begins with, and the least and largest. The moduli of nearer ones would be large
# and cancel each other.
_GRID = (-8.0, -4.0, -2.0, -1.0, 0.5, 1.5, 2.0, 3.0, 4.0, 6.0, 9.0, 13.0)
_LEAST_EXPONENT, _LARGEST_EXPONENT, _LEAST_GAP = -12.0, 20.0, 0.5
# Starts of the grid that are refined, and the most steps of one.
_STARTS, _MOST_STEPS = 2, 40
# Stretches in each mode at which a constrained fit is kept stable, and its margin in initial shear moduli.
_CHECKS, _MARGIN = 41, 1e-3
# Least root mean square of an Ogden term's stress, over what errors are compared with: the rows do not tell a
# smaller one, which may be large in a mode that was not tested.
_LEAST_SHARE = 3e-3


@dataclass(frozen=True)
class Candidate:
    """A kind of law.

    Parameters
    ----------
    name : for people.
    constants : number of constants.
    fit : returns the fitted law; raises a ValueError where none is stable.
    """

    name: str
    constants: int
    fit: Callable[[Points], Material]


class _OgdenTerm:
    """Ogden term of μ = 1."""

    def __init__(self, alpha: float) -> None:
        self.alpha = alpha

    def slope(self, stretches: np.ndarray) -> np.ndarray:
        return 2.0 / self.alpha * np.expm1(self.alpha * np.log(stretches))

    def curvature(self, stretches: np.ndarray) -> np.ndarray:
        return 2.0 * (stretches**self.alpha)[..., None] * np.eye(3)


class _YeohTerm:
    """W = (Ī1 − 3)^power."""

    def __init__(self, power: int) -> None:
        self.power = power

    def slope(self, stretches: np.ndarray) -> np.ndarray:
        squared = stretches**2
        excess = squared.sum(axis=-1, keepdims=True) - 3.0
        return 2.0 * self.power * excess ** (self.power - 1) * squared

    def curvature(self, stretches: np.ndarray) -> np.ndarray:
        squared, power = stretches**2, self.power
        excess = (squared.sum(axis=-1) - 3.0)[..., None, None]
        curved = 4.0 * power * excess ** (power - 1) * squared[..., None] * np.eye(3)
        if power > 1:
            second = power * (power - 1) * excess ** (power - 2)
            curved = curved + 4.0 * second * squared[..., :, None] * squared[..., None, :]
        return curved


_Terms: TypeAlias = Sequence[_OgdenTerm | _YeohTerm]
_Law = TypeVar("_Law", bound=Material)


class _Linear:
    """Weighted least squares of constants.

    Parameters
    ----------
    points, terms : rows, and what the constants multiply.
    """

    def __init__(self, points: Points, terms: _Terms) -> None:
        weight = np.sqrt(points.weight) / points.scale
        slopes = np.stack([term.slope(points.principal) for term in terms])
        matrix = (weight / points.stretch)[:, None] * (slopes[:, :, 0] - slopes[:, :, 2]).T
        # Constants of one size: those of high powers are small.
        self.size = np.linalg.norm(matrix, axis=0)
        self.matrix = matrix / self.size
        self.wanted = weight * points.stress

    def residual(self, scaled: np.ndarray) -> np.ndarray:
        """Return the weighted errors."""
        return self.matrix @ scaled - self.wanted

    def best(self) -> np.ndarray:
        """Return the best constants, scaled."""
        return np.asarray(np.linalg.lstsq(self.matrix, self.wanted)[0])

    def positive(self) -> np.ndarray:
        """Return the best constants that are not negative, scaled; they are stable."""
        return np.asarray(nnls(self.matrix, self.wanted)[0])

    def stable(self, terms: _Terms, stretch_range: tuple[float, float]) -> np.ndarray:
        """Return the best constants whose Drucker matrices are positive definite: a convex problem."""
        lam = np.geomspace(*stretch_range, _CHECKS)
        stretches = np.concatenate([principal_stretches(mode, lam) for mode in MODES])
        matrices = np.stack([drucker_matrix(term, stretches) for term in terms], axis=-1) / self.size
        start = self.positive()
        if not start.any():
            raise ValueError("no stable constants are near the rows")
        # Matrices of one size, at rest as at the largest stretch.
        about = np.maximum(start, _MARGIN * start.max())
        matrices /= np.trace(matrices @ about, axis1=1, axis2=2)[:, None, None, None]

        def smallest(scaled: np.ndarray) -> np.ndarray:
            return np.linalg.eigvalsh(matrices @ scaled)[:, 0] - _MARGIN

        unit = float(np.linalg.norm(self.wanted))

        def square(scaled: np.ndarray) -> float:
            return float((self.residual(scaled) ** 2).sum()) / unit**2

        found = minimize(
            square,
            start,
            jac=lambda scaled: 2.0 * self.matrix.T @ self.residual(scaled) / unit**2,
            constraints={"type": "ineq", "fun": smallest},
            method="SLSQP",
            options={"maxiter": 200, "ftol": 1e-12},
        )
        return np.asarray(found.x) if square(found.x) < square(start) else start


def _fit_linear(
    points: Points, terms: _Terms, made: Callable[[tuple[float, ...], tuple[float, float]], _Law]
) -> _Law:
    """Return the law of the best constants that are stable."""
    problem, stretch_range = _Linear(points, terms), points.stretch_range
    tries = (
        problem.best,
        lambda: problem.stable(terms, stretch_range),
        problem.positive,
    )
    for solve in tries:
        try:
            return made(tuple(float(c) for c in solve() / problem.size), stretch_range)
        except ValueError as error:
            why = error
    raise why


def _fit_neo_hookean(points: Points) -> Material:
    return _fit_linear(points, [_OgdenTerm(2.0)], lambda c, tested: neo_hookean(c[0], None, tested))


def _fit_mooney_rivlin(points: Points) -> Material:
    # C10 and C01 are half of the moduli.
    terms = [_OgdenTerm(2.0), _OgdenTerm(-2.0)]
    return _fit_linear(points, terms, lambda c, tested: mooney_rivlin(c[0] / 2.0, c[1] / 2.0, None, tested))


def _fit_yeoh(points: Points, count: int) -> Material:
    terms = [_YeohTerm(power) for power in range(1, count + 1)]
    return _fit_linear(points, terms, lambda c, tested: Yeoh(c, stretch_range=tested))


def _fit_ogden(points: Points, count: int) -> Material:
    """Return the stable Ogden solid of least error whose every term matters, from a grid of exponents on."""
    found: list[tuple[float, int, Ogden]] = []
    for one_sign in (True, False):

        def terms(gaps: np.ndarray) -> Sequence[_OgdenTerm]:
            # Not zero, which is no exponent.
            return [_OgdenTerm(float(alpha) or 1e-9) for alpha in np.cumsum(gaps)]

        def errors(gaps: np.ndarray, one_sign: bool = one_sign) -> np.ndarray:
            problem = _Linear(points, terms(gaps))
            return problem.residual(problem.positive() if one_sign else problem.best())

        starts = [np.diff(alphas, prepend=0.0) for alphas in itertools.combinations(_GRID, count)]
        starts.sort(key=lambda gaps: float(np.linalg.norm(errors(gaps))))
        least = [_LEAST_EXPONENT, *[_LEAST_GAP] * (count - 1)]
        for start in starts[:_STARTS]:
            gaps = least_squares(
                errors,
                np.clip(start, np.add(least, 1e-3), None),
                bounds=(least, _LARGEST_EXPONENT),
                # An exponent to five digits is more than rows tell.
                xtol=1e-5,
                ftol=1e-6,
                max_nfev=_MOST_STEPS,
            ).x
            exponents = tuple(term.alpha for term in terms(gaps))
            try:
                law = _fit_linear(points, terms(gaps), partial(_ogden, exponents))
            except ValueError:
                continue
            if _least_share(points, law) < _LEAST_SHARE:
                continue
            found.append((points.root_mean_square(law), len(found), law))
    if not found:
        raise ValueError(f"no {count} Ogden terms are stable and told by the rows")
    return min(found)[2]


def _ogden(
    exponents: tuple[float, ...], moduli: tuple[float, ...], stretch_range: tuple[float, float]
) -> Ogden:
    return Ogden(moduli, exponents, stretch_range=stretch_range)


def _least_share(points: Points, law: Ogden) -> float:
    """Return the least root mean square of a term's stress, over what errors are compared with."""
    shares = []
    for mu, alpha in zip(law.shear_moduli, law.exponents, strict=True):
        slope = mu * _OgdenTerm(alpha).slope(points.principal)
        share = (slope[:, 0] - slope[:, 2]) / points.stretch / points.scale
        shares.append(float(np.sqrt(np.average(share**2, weights=points.weight))))
    return min(shares)


#: Yeoh's solid of one constant is the neo-Hookean one.
CANDIDATES: tuple[Candidate, ...] = (
    Candidate("neo-Hookean", 1, _fit_neo_hookean),
    Candidate("Mooney–Rivlin", 2, _fit_mooney_rivlin),
    Candidate("Ogden 1", 2, lambda points: _fit_ogden(points, 1)),
    Candidate("Yeoh 2", 2, lambda points: _fit_yeoh(points, 2)),
    Candidate("Yeoh 3", 3, lambda points: _fit_yeoh(points, 3)),
    Candidate("Ogden 2", 4, lambda points: _fit_ogden(points, 2)),
    Candidate("Ogden 3", 6, lambda points: _fit_ogden(points, 3)),
)
