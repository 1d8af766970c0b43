"""What Newton's method does where the stiffness is not the branch's: other matrices, and longer steps.

A matrix with more negative eigenvalues than the branch of equilibria has leads to a saddle or round in
circles. Contact of walls is then made convex, with as large a share of the rod's roundness left out as it
takes, and where that is not enough the silicone viscous. Steps with such a matrix are too short along what is
soft: there they come to be alike, each a fixed multiple q of the one before, shrinking towards a minimum or
growing away from a saddle.
"""

import logging
from typing import Any

import numpy as np
from jaxtyping import Float

from fem_reference.algebra import SymmetricSolver
from fem_reference.errors import UnstableError
from fem_reference.solver.problem import Problem

_LOG = logging.getLogger(__name__)

# Damped steps with which Newton's method gives up, the first where it must end with the stiffness itself: so
# long a way may well end on another branch. Elsewhere steps grow away from a saddle and shrink again over 20
# of them and more.
_MOST_EXACT, _MOST = 8, 40
# Negative pivots that the first matrix may have.
_MOST_FIRST = 20
# Iterations in which viscosity may be added, and its rates, as shares of the silicone's stiffness at rest,
# tried in turn where equilibria must come with their own stiffness; elsewhere for one negative pivot too
# many, for two, and for more. Soft sways want little; of 30 matrices of random designs with three negative
# pivots or more all wanted the last, of 26 with two one the second.
_VISCOUS_ITERATIONS = 6
_RATES = (0.2, 0.8, 3.2, 12.8)
_RATES_BY_EXCESS = _RATES, (0.2, 3.2, 12.8), (0.2, 12.8)
# Shares of the rod's roundness that are left out, tried in turn: it is tens of times the stiffness of what
# sways around it, and steps without any of it are as much too short.
_SHARES = (0.0, 0.25, 0.5, 1.0)
# Where one of them leaves more negative pivots than this, the last is tried next: of 61 shares between that
# were tried for random designs none served.
_MANY = 8


class InertiaCorrection:
    """Matrices of the branch's inertia where the stiffness has another: convex contact, then viscosity.

    Parameters
    ----------
    problem, solver : what, and by what.
    inertia : of the branch.
    viscous : whether viscosity may be added.
    least : share of the rod's roundness to leave out, below which none is tried.
    """

    def __init__(
        self, problem: Problem, solver: SymmetricSolver, inertia: int, viscous: bool, least: float = 0.0
    ) -> None:
        self._problem, self._solver = problem, solver
        self._inertia = inertia
        self._left = _VISCOUS_ITERATIONS if viscous else 0
        self._most = _MOST_EXACT if problem.exact else _MOST
        self._rate = 0.0
        self._steps = 0
        shares = _SHARES[-1:] if problem.exact else _SHARES
        self._shares = tuple(share for share in shares if share >= least)
        self._raised = False
        #: Whether the last matrix had no negative pivots without viscosity.
        self.bare = False

    @property
    def share(self) -> float:
        """Of the rod's roundness that is left out."""
        return self._shares[0]

    @property
    def next_share(self) -> float:
        """Share to begin the next equilibrium with: the one below, unless that was too little here."""
        return self.share if self._raised else max((s for s in _SHARES if s < self.share), default=0.0)

    def factorise(self, at: Any, linear: Any, first: bool) -> None:
        """Leave the factors of such a matrix in the solver, or raise an `UnstableError`.

        A ``first`` one may keep some negative pivots: an extrapolated start has single elements that lack the
        pressure which the first step gives them.
        """
        self._steps += 1
        if self._steps > self._most:
            raise UnstableError(f"no equilibrium after {self._most} steps with another stiffness")
        problem = self._problem
        convex = problem.convexified_contact(linear)
        roundness = problem.core_curvature_stiffness(linear)
        counts: dict[int, int] = {}
        excess = 0
        for index, share in enumerate(self._shares):
            if excess > _MANY and share < self._shares[-1]:
                continue
            data = convex - share * roundness
            excess = self._excess(data, linear)
            _LOG.debug("walls convex, %.2g of roundness left out: %d negative pivots", share, excess)
            self.bare = excess <= 0
            if self.bare:
                # What was too little stays so as long as steps do not leave the place.
                self._leave_out(index)
                return
            counts[index] = excess
        if first and not problem.exact and excess <= _MOST_FIRST:
            # As little as leaves no more of them than all of it.
            best = next(index for index, count in counts.items() if count == excess)
            if best < index:
                self._excess(convex - self._shares[best] * roundness, linear)
            self._leave_out(best)
            return
        self._leave_out(index)
        self._left -= 1
        if self._left >= 0:
            resistance = problem.viscous(at, 1.0)
            rates = _RATES if problem.exact else _RATES_BY_EXCESS[min(excess, len(_RATES_BY_EXCESS)) - 1]
            for rate in (rate for rate in rates if rate >= self._rate):
                if self._excess(problem.stiffened(data, resistance.times(rate), linear), linear) <= 0:
                    _LOG.debug("viscosity %.2g added for %d negative pivots", rate, excess)
                    self._rate = rate
                    return
        raise UnstableError(f"the stiffness has {excess} negative eigenvalues more than the branch")

    def _leave_out(self, index: int) -> None:
        """That share and no less from now on."""
        self._raised = self._raised or index > 0
        self._shares = self._shares[index:]

    def _excess(self, data: Float[np.ndarray, " nonzeros"], linear: Any) -> int:
        pattern = self._problem.pattern
        negative = self._solver.factorise(pattern.matrix(data), pattern.revision)
        excess = self._problem.excess(self._solver, linear, negative)
        return 0 if excess is None else excess - self._inertia
