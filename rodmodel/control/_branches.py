"""Which branch an actuator is on: upright while it is loaded, or with a partition wall snapped to one side.

A branch ends where its law's domain does. Between the pressure at which it snaps on the way up and that at
which it returns, both are possible, and the one that an actuator is on depends on where it comes from.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from rodmodel.actuator import Domain
from rodmodel.core import CoreRod, CoreSolution, Numbers

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
    """

    chamber: int = 0
    side: int = 0

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
    pressure : gauge pressures [Pa], (3,).
    domain : of the branch.
    other_domains : of the branches of another name.
    """

    solution: CoreSolution
    branch: Branch
    jumped: bool
    pressure: tuple[float, float, float]
    domain: Domain
    other_domains: tuple[Domain, ...]

    @property
    def other_possible(self) -> bool:
        """Whether an actuator with another past may be on another branch under these pressures."""
        return any(_covers(other, self.pressure) for other in self.other_domains)

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
        self._snapped_domains = tuple(rod.domain for rod in self.snapped.values())

    def rod(self, branch: Branch) -> CoreRod:
        """Return the rod of a branch.

        Raises
        ------
        ValueError
            If the calibration does not know the branch.
        """
        if branch == LOADING:
            return self.loading
        if branch not in self.snapped:
            known = "; ".join(map(str, (LOADING, *self.snapped)))
            raise ValueError(f"branch: got {branch}, expected one that the calibration knows: {known}")
        return self.snapped[branch]

    def branch_at(self, pressure: Numbers, before: Branch = LOADING) -> Branch:
        """Return the branch under three pressures [Pa] of an actuator that was on another one before.

        It stays on its branch to that branch's end. There it jumps: to the loading branch if that one has
        such a state, else to that of the chamber with the largest pressure. If none has, it stays.
        """
        p = _three(pressure)
        if _covers(self.rod(before).domain, p):
            return before
        order = sorted(self.snapped, key=lambda branch: -p[branch.chamber - 1])
        return next((b for b in (LOADING, *order) if _covers(self.rod(b).domain, p)), before)

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
        p = _three(pressure)
        now = self.branch_at(p, before)
        if branch == "loading":
            now = LOADING
        elif branch == "snapped":
            now = self._snapped_at(p, before)
        rod = self.rod(now)
        return BranchSolution(
            solution=rod.solve(pressure, **given),
            branch=now,
            jumped=now != before,
            pressure=p,
            domain=rod.domain,
            other_domains=self._snapped_domains if now == LOADING else (self.loading.domain,),
        )

    def _snapped_at(self, pressure: tuple[float, float, float], before: Branch) -> Branch:
        chamber = int(np.argmax(pressure)) + 1
        of_chamber = [b for b in self.snapped if b.chamber == chamber]
        if not of_chamber:
            known = "; ".join(map(str, self.snapped)) or "none"
            raise ValueError(
                f"branch: got snapped with the largest pressure in chamber {chamber}, expected a snapped "
                f"branch that the calibration knows: {known}"
            )
        return before if before in of_chamber else of_chamber[0]


def _three(pressure: Numbers) -> tuple[float, float, float]:
    p = np.asarray(pressure, float)
    if p.shape != (3,):
        raise ValueError(f"pressure: got shape {p.shape}, expected (3,): three gauge pressures [Pa]")
    # Plain numbers: an array of three costs a domain ten times as much.
    first, second, third = p.tolist()
    return first, second, third


def _covers(domain: Domain, pressure: tuple[float, float, float]) -> bool:
    return bool(domain.covers_pressure(pressure))
