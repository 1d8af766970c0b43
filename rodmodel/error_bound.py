"""Bound on the errors of a prediction, over its bend, the pressures' sum and the load. Needs no JAX."""

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

    Each is a sum of three: a term over the sum of the pressures, one over the predicted bending angle θ, and
    one in proportion to the moment that the loads put on the base. The first two are linear between nodes and
    constant outside them.

    Attributes
    ----------
    pressure_sum : sums of the three pressures at the nodes, increasing, 1 to 8 of them [Pa].
    angle : terms of the bound of θ at these nodes, not decreasing [rad].
    tip : terms of the bound of the tip's distance at these nodes, not decreasing [m]; empty, or all NaN,
        where no bound of the tip is known.
    angle_per_moment, tip_per_moment : what either grows by with the moment on the base, [rad/(N m)] and
        [1/N].
    bending_angle : predicted θ at the nodes of the second term, increasing, 1 to 8 of them [rad].
    angle_by_bend, tip_by_bend : what either grows by at these nodes, not decreasing [rad], [m].

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
    bending_angle: tuple[Number, ...] = (0.0,)
    angle_by_bend: tuple[Number, ...] = (0.0,)
    tip_by_bend: tuple[Number, ...] = (0.0,)

    def __post_init__(self) -> None:
        """Refuse nodes that tell no bound."""
        for nodes, values in (
            ("pressure_sum", ("angle", "tip")),
            ("bending_angle", ("angle_by_bend", "tip_by_bend")),
        ):
            count = len(getattr(self, nodes))
            if not 1 <= count <= MOST_NODES:
                raise ValueError(f"{nodes}: got {count} nodes, expected 1 to {MOST_NODES}")
            for name in values:
                came = len(getattr(self, name))
                if came != count and (name != "tip" or came):
                    raise ValueError(f"{name}: got {came} numbers, expected {count}, one at each node")
            _refuse_decreasing(nodes, getattr(self, nodes), strictly=True)
            for name in values:
                _refuse_decreasing(name, getattr(self, name), strictly=False)
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
        return self.angle[-1] + self.angle_by_bend[-1]

    @property
    def padded(self) -> "ErrorBound":
        """The same bound with as many nodes as there may be, as the core and stacks of rods take it."""
        return replace(
            self,
            # Nodes a pascal, or a radian, apart still differ in single precision.
            pressure_sum=_padded(self.pressure_sum, 1.0),
            angle=_padded(self.angle),
            tip=_padded(self.tip or (math.nan,)),
            bending_angle=_padded(self.bending_angle, 1.0),
            angle_by_bend=_padded(self.angle_by_bend),
            tip_by_bend=_padded(self.tip_by_bend),
        )

    def at_least(self, angle: float, tip: float) -> "ErrorBound":
        """Return the bound that is nowhere below a constant one; an unknown one of the tip stays so."""
        return replace(
            self,
            angle=tuple(max(bound, angle) for bound in self.angle),
            tip=tuple(max(bound, tip) for bound in self.tip),
        )

    @property
    def without_bend(self) -> "ErrorBound":
        """The same bound without the term over θ."""
        return replace(self, bending_angle=(0.0,), angle_by_bend=(0.0,), tip_by_bend=(0.0,))

    def at(
        self, pressure_sum: Number, moment: Number = 0.0, *, bending_angle: Number | None = None
    ) -> tuple[Number, Number]:
        """Return the bounds of θ [rad] and of the tip [m], NaN where none is known.

        Parameters
        ----------
        pressure_sum : sum of the three pressures [Pa]; a number or an array.
        moment : norm of the moment that the loads put on the base [N m].
        bending_angle : predicted θ [rad]; without it the bounds are those of the largest bend.
        """
        if bending_angle is None:
            bending_angle = self.bending_angle[-1]
        loaded = _shares(self.pressure_sum, pressure_sum)
        bent = _shares(self.bending_angle, bending_angle)
        unknown = (math.nan,) * len(self.angle)
        return (
            _along(self.angle, loaded, pressure_sum)
            + _along(self.angle_by_bend, bent, bending_angle)
            + self.angle_per_moment * moment,
            _along(self.tip or unknown, loaded, pressure_sum)
            + _along(self.tip_by_bend, bent, bending_angle)
            + self.tip_per_moment * moment,
        )


def _padded(values: tuple[Number, ...], step: float = 0.0) -> tuple[Number, ...]:
    """Return values with further ones after the last, each by so much larger."""
    return (*values, *(values[-1] + step * k for k in range(1, MOST_NODES - len(values) + 1)))


def _shares(nodes: tuple[Number, ...], at: Number) -> list[Number]:
    """Return how much of the way from each node to the next lies below a value, from 0 to 1."""
    shares = []
    for first, last in pairwise(nodes):
        way = (at - first) / (last - first)
        # In plain arithmetic, which floats and arrays of NumPy and JAX share.
        shares.append(way * ((way > 0.0) & (way < 1.0)) + (way >= 1.0))
    return shares


def _along(values: tuple[Number, ...], shares: list[Number], at: Number) -> Number:
    """Return what is linear between nodes, of the shape of ``at``."""
    found = values[0] + 0.0 * at
    for share, (before, after) in zip(shares, pairwise(values), strict=True):
        found = found + share * (after - before)
    return found


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
