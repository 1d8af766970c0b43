"""Bound on the errors of a prediction, over the pressures' sum and the load. Needs no JAX."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import final

from rodmodel.actuator import Number

#: Largest number of nodes; the compiled core has room for so many.
MOST_NODES = 8


@final
@dataclass(frozen=True)
class ErrorBound:
    """Bound that the errors of 90 % of states keep: of the bending angle θ and of the tip.

    Each is linear in the sum of the pressures between nodes, constant outside them, plus a term linear in
    the moment that the loads put on the base.

    Attributes
    ----------
    pressure_sum : sums of the three pressures at the nodes, increasing, 1 to 8 of them [Pa].
    angle : bounds of the error of θ at the nodes, not decreasing [rad].
    tip : bounds of the tip's distance at the nodes, not decreasing [m]; empty, or all NaN, where none is
        known.
    angle_per_moment, tip_per_moment : what either grows by with the moment on the base, [rad/(N m)] and
        [1/N].

    Raises
    ------
    ValueError
        For plain numbers that are negative or not finite, nodes that do not increase, or bounds that
        decrease.
    """

    pressure_sum: tuple[Number, ...]
    angle: tuple[Number, ...]
    tip: tuple[Number, ...] = ()
    angle_per_moment: Number = 0.0
    tip_per_moment: Number = 0.0

    def __post_init__(self) -> None:
        """Refuse nodes that tell no bound."""
        count = len(self.pressure_sum)
        if not 1 <= count <= MOST_NODES:
            raise ValueError(f"pressure_sum: got {count} nodes, expected 1 to {MOST_NODES}")
        for name in ("angle", "tip"):
            if len(getattr(self, name)) != count and (name == "angle" or self.tip):
                raise ValueError(
                    f"{name}: got {len(getattr(self, name))} numbers, expected {count}, one at each node"
                )
        for name, strictly in (("pressure_sum", True), ("angle", False), ("tip", False)):
            _refuse_decreasing(name, getattr(self, name), strictly)
        for name in ("angle_per_moment", "tip_per_moment"):
            _refuse_decreasing(name, (getattr(self, name),), strictly=False)

    @classmethod
    def constant(cls, angle: Number) -> "ErrorBound":
        """Return the bound of θ that is the same for all pressures and loads [rad], with none of the tip."""
        return cls((0.0,), (angle,))

    @classmethod
    def of(cls, bound: "ErrorBound | Number") -> "ErrorBound":
        """Return a bound as it is, and a number as a constant bound of θ [rad]."""
        return bound if isinstance(bound, ErrorBound) else cls.constant(bound)

    @property
    def largest_angle(self) -> Number:
        """Largest bound of θ without loads [rad]."""
        return self.angle[-1]

    @property
    def padded(self) -> "ErrorBound":
        """The same bound with as many nodes as there may be, as the core and stacks of rods take it."""
        more = MOST_NODES - len(self.pressure_sum)
        last = self.pressure_sum[-1]
        return replace(
            self,
            # Nodes a pascal apart still differ in single precision.
            pressure_sum=(*self.pressure_sum, *(last + float(k) for k in range(1, more + 1))),
            angle=(*self.angle, *[self.angle[-1]] * more),
            tip=(*self.tip, *[self.tip[-1]] * more) if self.tip else (math.nan,) * MOST_NODES,
        )

    def at_least(self, angle: float, tip: float) -> "ErrorBound":
        """Return the bound that is nowhere below a constant one; an unknown one of the tip stays so."""
        return replace(
            self,
            angle=tuple(max(bound, angle) for bound in self.angle),
            tip=tuple(max(bound, tip) for bound in self.tip),
        )

    def at(self, pressure_sum: Number, moment: Number = 0.0) -> tuple[Number, Number]:
        """Return the bounds of θ [rad] and of the tip [m], NaN where none is known.

        Parameters
        ----------
        pressure_sum : sum of the three pressures [Pa]; a number or an array.
        moment : norm of the moment that the loads put on the base [N m].
        """
        shares = self._shares(pressure_sum)

        def along(values: tuple[Number, ...]) -> Number:
            rises = (after - before for before, after in pairwise(values))
            found = values[0] + 0.0 * pressure_sum
            for share, rise in zip(shares, rises, strict=True):
                found = found + share * rise
            return found

        return (
            along(self.angle) + self.angle_per_moment * moment,
            along(self.tip or (math.nan,) * len(self.angle)) + self.tip_per_moment * moment,
        )

    def _shares(self, pressure_sum: Number) -> list[Number]:
        """Return how much of the way from each node to the next lies below a sum, from 0 to 1."""
        shares = []
        for first, last in pairwise(self.pressure_sum):
            way = (pressure_sum - first) / (last - first)
            # In plain arithmetic, which floats and arrays of NumPy and JAX share.
            shares.append(way * ((way > 0.0) & (way < 1.0)) + (way >= 1.0))
        return shares


def _refuse_decreasing(name: str, values: tuple[Number, ...], strictly: bool) -> None:
    """Refuse plain numbers below zero, not finite, or that decrease; of an unknown tip all are NaN."""
    plain = [value for value in values if isinstance(value, float | int)]
    if name == "tip" and all(map(math.isnan, plain)):
        return
    for value in plain:
        if not (math.isfinite(value) and value >= 0.0):
            raise ValueError(f"{name}: got {value:g}, expected finite numbers of 0 or more")
    for before, after in pairwise(plain):
        if after < before or (strictly and after == before):
            rising = "increasing" if strictly else "not decreasing"
            raise ValueError(f"{name}: got {after:g} after {before:g}, expected numbers that are {rising}")
