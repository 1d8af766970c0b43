"""The core's minimum of a quadratic over the pressures of a domain is that of an independent method.

The reference is the least-distance problem of Lawson and Hanson (1974), Solving Least Squares Problems, ch.
23: with H = L Lᵀ and c the minimum without bounds, |Lᵀ(x − c)| is least where a problem of non-negative least
squares ends, which SciPy solves.
"""

import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.stats import ortho_group

from tests.verification.core.toolchain import C99, build, compiler, exported

HERE = Path(__file__).parent
CASES = 2000
FLOAT = "-DRM_REAL_FLOAT"


class Case(NamedTuple):
    """A quadratic d·H d/2 + g·d, with d from `point`, over a domain or its face without a chamber."""

    domain: np.ndarray
    matrix: np.ndarray
    gradient: np.ndarray
    point: np.ndarray
    without: int

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Normals and bounds of the upper limits, (n, 3) and (n,)."""
        *largest, total, share, beside = self.domain
        normals = [np.eye(3), np.ones((1, 3)), share + (1.0 - share) * np.eye(3)]
        bounds = np.array([*largest, total, *[beside] * 3])
        count = 7 if beside > 0.0 else 4
        return np.concatenate(normals)[:count], bounds[:count]

    @property
    def line(self) -> str:
        lower = self.matrix[np.triu_indices(3)]
        numbers = [*self.domain, *lower, *self.gradient, *self.point]
        return " ".join(f"{x:.17g}" for x in numbers) + f" {self.without}\n"


def case(random: np.random.Generator, kind: type, most: float) -> Case:
    """A random case, with a condition of the matrix up to `most`; a third of them have no limit beside."""
    sizes = 10.0 ** random.uniform(-np.log10(most), 0.0, 3)
    axes = ortho_group.rvs(3, random_state=random)
    matrix = (axes * sizes) @ axes.T
    largest = random.uniform(0.3, 1.0, 3)
    total = random.uniform(0.4, 1.0) * largest.sum()
    share = random.uniform(0.0, 0.8)
    beside = 0.0 if random.random() < 1 / 3 else random.uniform(0.5, 1.2)
    without = int(random.integers(-1, 3))
    rough = Case(np.array([*largest, total, share, beside]), matrix, np.zeros(3), np.zeros(3), without)
    normals, bounds = rough.limits
    point = random.uniform(0.0, 1.0, 3) * (np.arange(3) != without)
    # Every other one from a facet, where searches are.
    reach = (normals @ point / bounds).max()
    point *= (1.0 if random.random() < 0.5 else random.random()) / reach
    # The minimum without bounds lies inside about as often as beyond each facet.
    gradient = matrix @ (point - random.uniform(-0.5, 1.5, 3))
    parts = (np.asarray(part.astype(kind), float) for part in (rough.domain, matrix, gradient, point))
    return Case(*parts, without)


def minimum(given: Case) -> np.ndarray:
    """The minimum by non-negative least squares."""
    free = [k for k in range(3) if k != given.without]
    normals, bounds = given.limits
    matrix = given.matrix[np.ix_(free, free)]
    start = given.point[free]
    centre = start - np.linalg.solve(matrix, given.gradient[free])
    lower = np.linalg.cholesky(matrix)
    sides = np.concatenate([normals[:, free], -np.eye(len(free))])
    distances = np.concatenate([bounds, np.zeros(len(free))]) - sides @ centre
    found = np.zeros(3)
    found[free] = centre
    if distances.min() >= 0.0:
        return found
    # Least |y| with G y ≥ h, in units of a feasible |y|.
    size = np.linalg.norm(lower.T @ (start - centre))
    g, h = -np.linalg.solve(lower, sides.T).T, -distances / size
    system = np.vstack([g.T, h])
    weights, _ = nnls(system, np.eye(len(free) + 1)[-1])
    residual = system @ weights - np.eye(len(free) + 1)[-1]
    found[free] += np.linalg.solve(lower.T, -size * residual[:-1] / residual[-1])
    return found


@pytest.mark.parametrize(
    ("precision", "kind", "most"), [("", np.float64, 1e8), (FLOAT, np.float32, 1e2)], ids=["double", "single"]
)
def test_minima_are_those_of_scipy_and_lie_in_the_domain(
    tmp_path: Path, precision: str, kind: type, most: float
) -> None:
    folder = exported(tmp_path / "rod")
    flags = [*C99, "-Wno-unused-function", "-O1", *([precision] if precision else [])]
    program = build(folder, compiler("gcc"), *flags, sources=(HERE / "polytope.c",), out="polytope")
    random = np.random.default_rng(7)
    cases = [case(random, kind, most) for _ in range(CASES)]
    text = "".join(given.line for given in cases)
    done = subprocess.run([program], input=text, capture_output=True, text=True, check=True)
    came = np.array([line.split() for line in done.stdout.splitlines()], float)
    assert came.shape == (CASES, 3)
    rounding = float(np.finfo(kind).eps)
    bounded = 0
    for given, point in zip(cases, came, strict=True):
        normals, bounds = given.limits
        assert np.all(point >= 0.0)
        # Single facets to the last bit; sums to the rounding of this check in double precision.
        assert np.all(normals @ point <= bounds * (1.0 + 1e-15))
        assert given.without < 0 or point[given.without] == 0.0
        expected = minimum(given)
        # A gradient rounded by some ε |H| |x|, or a multiplier's sign wrong by 32 ε (|H| + |g|), moves a
        # minimum by as much over the least eigenvalue; |H| ≤ 1, |g| ≤ 3.
        error = 128.0 * rounding * np.linalg.cond(given.matrix)
        np.testing.assert_allclose(point, expected, rtol=0.0, atol=error)
        bounded += np.any(np.abs(normals @ point - bounds) < 1e-5)
    # Both kinds are there: on a facet of the upper limits, and inside or on a coordinate's plane.
    assert 0.2 * CASES < bounded < 0.8 * CASES
