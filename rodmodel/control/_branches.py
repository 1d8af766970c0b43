"""Which branch an actuator is on: upright while it is loaded, or with a partition wall snapped to one side.

A branch ends where its law's domain does. Between the pressure at which it snaps on the way up and that at
which it returns, both are possible, and the one that an actuator is on depends on where it comes from.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from rodmodel.actuator import Domain
from rodmodel.core import BranchChoice, CoreRod, CoreSolution, Numbers

# What `Branches.solve` takes for its branch.
_NAMES = ("auto", "loading", "snapped")


@final
@dataclass(frozen=True)
class Branch:
    """A branch of equilibria.

    Attributes
    ----------
    chamber : number of the chamber beside which a wall has snapped, from 1; 0 on the loading branch.
    side : +1 if the bending plane's angle γ is larger than that of the upright rod, −1 if smaller; 0 on the
        loading branch.

    Raises
    ------
    ValueError
        For other numbers.
    """

    chamber: int = 0
    side: int = 0

    def __post_init__(self) -> None:
        """Refuse numbers that are no branch."""
        if (self.chamber, self.side) != (0, 0) and not (self.chamber in (1, 2, 3) and self.side in (1, -1)):
            raise ValueError(
                f"Branch: got chamber {self.chamber} and side {self.side}, expected 1, 2 or 3 with 1 or -1"
            )

    @property
    def name(self) -> str:
        """``loading`` or ``snapped``."""
        return "snapped" if self.chamber else "loading"

    def __str__(self) -> str:
        """The branch in words."""
        if not self.chamber:
            return "loading"
        towards = "larger" if self.side > 0 else "smaller"
        return f"snapped by chamber {self.chamber}, to {towards} bending planes"


LOADING = Branch()


@final
@dataclass(frozen=True)
class BranchSolution:
    """A solution and its branch.

    Attributes
    ----------
    solution : equilibrium.
    branch : branch that it is on; the next call's `before`.
    jumped : whether that is another branch than before.
    other_possible : whether an actuator with another past may be on a branch of the other name under these
        pressures.
    pressure : gauge pressures [Pa], (3,).
    domain : of the branch.
    """

    solution: CoreSolution
    branch: Branch
    jumped: bool
    other_possible: bool
    pressure: tuple[float, float, float]
    domain: Domain

    @property
    def reach(self) -> float:
        """The largest factor on the pressures for which this branch goes on.

        It is below one beyond the branch's end, and infinite without pressure.
        """
        return self.domain.reach(self.pressure)


@final
class Branches:
    """The compiled rods of all branches of one actuator. `rodmodel.load_branches` makes them.

    Parameters
    ----------
    loading : rod of the loading branch.
    snapped : rods of the snapped branches, the likeliest side of each chamber first; none if the calibration
        knows none.
    """

    def __init__(self, loading: CoreRod, snapped: Mapping[Branch, CoreRod]) -> None:
        self.loading = loading
        self.snapped = dict(snapped)
        self._branches = (LOADING, *self.snapped)
        self._rods = (loading, *self.snapped.values())
        self._numbers = {branch: number for number, branch in enumerate(self._branches)}
        self._choice = BranchChoice(
            self._rods,
            [branch.chamber for branch in self._branches],
            [branch.side for branch in self._branches],
        )

    def rod(self, branch: Branch) -> CoreRod:
        """Return the rod of a branch.

        Raises
        ------
        ValueError
            If the calibration does not know the branch.
        """
        return self._rods[self._number(branch)]

    def branch_at(self, pressure: Numbers, before: Branch = LOADING) -> Branch:
        """Return the branch under three pressures [Pa] of an actuator that was on another one before.

        It stays on its branch to that branch's end. There it jumps: to the loading branch if that one has
        such a state, else to that of the chamber with the largest pressure. If none has, it stays.
        """
        return self._branches[self._choice.at(_three(pressure), self._number(before))]

    def solve(
        self, pressure: Numbers, before: Branch = LOADING, branch: str = "auto", **given: Any
    ) -> BranchSolution:
        """Solve on the branch that the actuator's past leads to, or on a given one.

        Parameters
        ----------
        pressure : gauge pressures [Pa], (3,).
        before : branch before this call; from rest, the loading branch.
        branch : ``auto`` follows `branch_at`; ``loading`` and ``snapped`` ask for one, the latter for that of
            the chamber with the largest pressure, on the side of `before` if there is a choice.
        given : loads and options of `CoreRod.solve`.

        Raises
        ------
        ValueError
            For another word, or a snapped branch that the calibration does not know.
        RuntimeError
            See `CoreRod.solve`.
        """
        if branch not in _NAMES:
            raise ValueError(f"branch: got {branch!r}, expected {', '.join(_NAMES)}")
        p, start = _three(pressure), self._number(before)
        number = self._choice.at(p, start)
        if branch == "loading":
            number = 0
        elif branch == "snapped":
            number = self._numbers[self._snapped_at(p, before)]
        rod = self._rods[number]
        first, second, third = p.tolist()
        return BranchSolution(
            solution=rod.solve(p, **given),
            branch=self._branches[number],
            jumped=number != start,
            other_possible=self._choice.other_possible(p, number),
            pressure=(first, second, third),
            domain=rod.domain,
        )

    def _number(self, branch: Branch) -> int:
        number = self._numbers.get(branch)
        if number is None:
            known = "; ".join(map(str, self._branches))
            raise ValueError(f"branch: got {branch}, expected one that the calibration knows: {known}")
        return number

    def _snapped_at(self, pressure: np.ndarray, before: Branch) -> Branch:
        chamber = int(np.argmax(pressure)) + 1
        of_chamber = [b for b in self.snapped if b.chamber == chamber]
        if not of_chamber:
            known = "; ".join(map(str, self.snapped)) or "none"
            raise ValueError(
                f"branch: got snapped with the largest pressure in chamber {chamber}, expected a snapped "
                f"branch that the calibration knows: {known}"
            )
        return before if before in of_chamber else of_chamber[0]


def _three(pressure: Numbers) -> np.ndarray:
    p = np.ascontiguousarray(pressure, float)
    if p.shape != (3,):
        raise ValueError(f"pressure: got shape {p.shape}, expected (3,): three gauge pressures [Pa]")
    return p
