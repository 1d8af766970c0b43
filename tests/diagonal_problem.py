"""Springs beside each other under loads, as a problem for Newton's method, relaxation and continuation."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fem_reference.algebra import SparsePattern
from fem_reference.algebra.factorisation import PardisoSolver
from fem_reference.solver import Contact, Linearisation, Problem, Tolerances


@dataclass(frozen=True)
class Move:
    positions: np.ndarray


@dataclass(frozen=True)
class Push:
    """Force on every spring [N]; a path's steps are of 0.1 N."""

    pressure: np.ndarray

    def between(self, other: "Push", fraction: float) -> "Push":
        return Push(self.pressure + fraction * (other.pressure - self.pressure))

    def to(self, other: "Push") -> np.ndarray:
        return (other.pressure - self.pressure) / 0.1


@dataclass(frozen=True)
class Resistance:
    """Viscous resistance of every spring to leaving a place."""

    origin: np.ndarray
    rate: float

    def times(self, factor: float) -> "Resistance":
        return Resistance(self.origin, factor * self.rate)


class Diagonal(Problem):
    """Uncoupled unknowns, each with its own force and stiffness under a load.

    Their viscous resistance to leaving a place is ``rate`` times a spring of 1 N/mm.
    """

    tolerances = Tolerances(
        max_step=0.0, modified_newton_step=0.0, contact_noise=0.0, exact_stiffness=True, desired_step=np.inf
    )
    contact = Contact()

    def __init__(self, force: Callable, stiffness: Callable, unknowns: int, reach: float) -> None:
        none = np.empty(0, np.int64)
        self.pattern = SparsePattern(unknowns, {"springs": np.arange(unknowns)[:, None]}, (none, none))
        self.tolerances = replace(self.tolerances, max_step=reach)
        self._force, self._stiffness = force, stiffness
        self.longest_step = 0.0
        self.stiffnesses = 0

    def begin(self, start, target):
        return start

    def linearise(self, at, target, viscous=None, before=None):
        self.stiffnesses += 1
        rate = 0.0 if viscous is None else viscous.rate
        linear = Linearisation(np.empty(0), self._stiffness(at) + rate, False)
        return self.update_forces(linear, at, target, viscous)

    def update_forces(self, linear, at, target, viscous=None):
        residual = self._force(at) - target.pressure
        if viscous is not None:
            residual = residual + viscous.rate * (at - viscous.origin)
        return replace(linear, residual=residual)

    def keeps(self, linear, at):
        return True

    def viscous(self, at, rate):
        return Resistance(at, rate)

    def stiffened(self, data, resistance, linear):
        return data + resistance.rate

    def newton_step(self, solver, linear, target):
        return Move(solver.solve(-linear.residual[:, None])[:, 0])

    def advance(self, at, step, fraction, linear):
        self.longest_step = max(self.longest_step, fraction * self.size(step, linear))
        return at + fraction * step.positions

    def allowed(self, linear, trial):
        return 1.0

    def mean(self, states, weights):
        return sum(w * s for w, s in zip(weights, states, strict=True))

    def distance(self, at, other):
        return float(np.abs(other - at).max())

    def may_start(self, at, guess):
        return True


def tolerate(problem: Problem, **changed: float | bool) -> None:
    """Change some of a problem's tolerances."""
    problem.tolerances = replace(problem.tolerances, **changed)


class Counted(PardisoSolver):
    """PARDISO that keeps the smallest number of every matrix."""

    def __init__(self) -> None:
        super().__init__()
        self.least: list[float] = []

    def factorise(self, upper, revision):
        self.least.append(float(upper.data.min()))
        return super().factorise(upper, revision)


def double_well(unknowns: int = 1, reach: float = 0.5) -> Diagonal:
    """Springs with the energy (x² − 1)²/4: minima at ±1, and between them a maximum at zero.

    Under a force f they are where x³ − x = f. The minimum left of zero ends in a fold at x = −1/√3, under a
    force of 2/(3√3) = 0.3849 N.
    """
    return Diagonal(lambda x: x**3 - x, lambda x: 3.0 * x**2 - 1.0, unknowns, reach)


FOLD = 2.0 / (3.0 * np.sqrt(3.0))


def well_minimum(force: float, side: float) -> float:
    """Where a double well's spring lies under a force, right (1) or left (−1) of the middle."""
    roots = np.roots([1.0, 0.0, -1.0, -force])
    real = roots[np.abs(roots.imag) < 1e-9].real
    return float(real[np.argmax(side * real)])
