"""Inertia correction: matrices with as many negative eigenvalues as the branch has.

A stiffness with more of them leads to a saddle or in circles. Wall contact is then made convex, pair by pair.
If that is not enough, a share of the rod's curvature stiffness is left out, off which a pressed wall slides,
and then the silicone becomes viscous. The pivots of the factorisation tell the inertia (Sylvester's law).
"""

import logging
from typing import Generic

import numpy as np
from jaxtyping import Float

from fem_reference.algebra import SymmetricSolver
from fem_reference.errors import UnstableError
from fem_reference.solver.equations import Linear, Move, State, Target, Viscous
from fem_reference.solver.options import DEFAULT, InertiaCorrectionOptions
from fem_reference.solver.problem import Problem

_LOG = logging.getLogger(__name__)


class InertiaCorrection(Generic[State, Target, Linear, Move, Viscous]):
    """Factors of a matrix with the branch's inertia: convex contact, then viscosity.

    Parameters
    ----------
    problem, solver : equations, and the linear solver that holds the factors.
    inertia : negative eigenvalues of the branch.
    viscous : whether viscosity may be added.
    least : smallest share of the rod's curvature stiffness that is left out.
    options : what is tried, and how often.
    """

    def __init__(
        self,
        problem: Problem[State, Target, Linear, Move, Viscous],
        solver: SymmetricSolver,
        inertia: int,
        viscous: bool,
        least: float = 0.0,
        options: InertiaCorrectionOptions = DEFAULT.inertia_correction,
    ) -> None:
        self._problem, self._solver, self._options = problem, solver, options
        self._inertia = inertia
        self._left = options.viscous_steps if viscous else 0
        self._most = options.exact_steps if problem.tolerances.exact_stiffness else options.steps
        self._rate = 0.0
        self._steps = 0
        shares = options.core_shares[-1:] if problem.tolerances.exact_stiffness else options.core_shares
        self._shares = tuple(share for share in shares if share >= least)
        self._raised = False
        #: Whether the last matrix had the branch's inertia without viscosity.
        self.bare = False

    @property
    def share(self) -> float:
        """Share of the rod's curvature stiffness that is left out."""
        return self._shares[0]

    @property
    def next_share(self) -> float:
        """Share for the next equilibrium: the one below the present one, unless that did not do here."""
        below = (s for s in self._options.core_shares if s < self.share)
        return self.share if self._raised else max(below, default=0.0)

    def factorise(self, at: State, linear: Linear, first: bool) -> None:
        """Leave the factors of a matrix with the branch's inertia in the solver.

        The ``first`` matrix may keep some negative pivots: in an extrapolated start single elements lack the
        pressure that the first step gives them.

        Raises
        ------
        UnstableError
            If no matrix has that inertia, or after too many of them.
        """
        self._steps += 1
        if self._steps > self._most:
            raise UnstableError(f"no equilibrium after {self._most} steps with another stiffness")
        problem = self._problem
        convex = problem.contact.convexified(linear)
        curvature_stiffness = problem.contact.core_curvature_stiffness(linear)
        counts: dict[int, int] = {}
        excess = 0
        for index, share in enumerate(self._shares):
            if excess > self._options.many_negative and share < self._shares[-1]:
                continue
            data = convex - share * curvature_stiffness
            excess = self._excess(data, linear)
            _LOG.debug("walls convex, %.2g of the rod's left out: %d negative pivots", share, excess)
            self.bare = excess <= 0
            if self.bare:
                # A share that did not do once does not do nearby either.
                self._leave_out(index)
                return
            counts[index] = excess
        if first and not problem.tolerances.exact_stiffness and excess <= self._options.first_negative:
            # The smallest share that does as well as all of it.
            best = next(index for index, count in counts.items() if count == excess)
            if best < index:
                self._excess(convex - self._shares[best] * curvature_stiffness, linear)
            self._leave_out(best)
            return
        self._leave_out(index)
        self._left -= 1
        if self._left >= 0:
            resistance = problem.viscous(at, 1.0)
            for rate in (rate for rate in self._rates(excess) if rate >= self._rate):
                if self._excess(problem.stiffened(data, resistance.times(rate), linear), linear) <= 0:
                    _LOG.debug("viscosity %.2g added for %d negative pivots", rate, excess)
                    self._rate = rate
                    return
        raise UnstableError(f"the stiffness has {excess} negative eigenvalues more than the branch")

    def _rates(self, excess: int) -> tuple[float, ...]:
        """Rates of viscosity to try for a number of negative pivots too many."""
        options = self._options
        if self._problem.tolerances.exact_stiffness or excess == 1:
            return options.rates
        return options.rates_of_two if excess == 2 else options.rates_of_more

    def _leave_out(self, index: int) -> None:
        """Leave out the share at ``index``, and no smaller one from now on."""
        self._raised = self._raised or index > 0
        self._shares = self._shares[index:]

    def _excess(self, data: Float[np.ndarray, " nonzeros"], linear: Linear) -> int:
        pattern = self._problem.pattern
        negative = self._solver.factorise(pattern.matrix(data), pattern.revision)
        excess = self._problem.excess(self._solver, linear, negative)
        return 0 if excess is None else excess - self._inertia
