"""Bounds of the rods' errors by split conformal prediction with scaled scores, one layout left out at a time.

The score of a state is its largest error against the truth in the limit of fine meshes (`Verdict.angle_off`,
`Verdict.tip_off`), divided by a scale σ. The scale is linear in the rod's bending angle between nodes, not
decreasing, plus a term linear in the moment on the base: the mean error of the `fit` runs by least squares.
Few of these have a load, so the growth with the moment is at least that of a rod whose response to a tip
force errs by as much, relative to it, as free bending does on the mean. The bound of a calibration is σ times
the 90th percentile of the scores of judge runs of all *other* layouts; each layout has the same weight,
however many runs it has. Where the scores in a quarter of half a turn have a larger percentile than all
together, that is taken there (Mondrian prediction). No part of a bound is made of the judge states that it is
judged on. What the scale hangs on was chosen after coverage had been seen: the pressures' sum before, and now
the angle, in which errors of stiffness and of meshes grow. All choices that were tried, with their coverage,
are in docs/notes/calibration.md.

If the layouts were drawn at random and their states were exchangeable, a state of a further layout would keep
the bound with a probability of at least 0.9 K/(K + 1) for K others (Lee, Barber, Willett), and of 0.9 if the
layouts were alike. Neither holds exactly: states of one run follow one another, and nobody drew the windings.
So `coverage_by` counts.

References
----------
Vovk, Gammerman, Shafer (2005), Algorithmic Learning in a Random World. Lei, G'Sell, Rinaldo, Tibshirani,
Wasserman (2018), Distribution-free predictive inference for regression, JASA 113, section 5.2 (scaled
scores). Barber, Candès, Ramdas, Tibshirani (2021), Predictive inference with the jackknife+, Annals of
Statistics 49. Lee, Barber, Willett (2023), Distribution-free inference with hierarchical data (HCP).
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import lsq_linear

from calibration.truth.cases import same_layout, title
from calibration.truth.compare_rods import Verdict
from rodmodel import ErrorBound, Layout

#: Share of states that is to keep a bound.
LEVEL = 0.9
#: Bending angles at the nodes of a bound [rad].
NODES = (0.0, 0.25 * np.pi, 0.5 * np.pi, 0.75 * np.pi, np.pi)
# Bending angle from which relative errors tell the compliance's [rad].
_BENT = np.deg2rad(10.0)
# Least scales of the angle [rad] and of the tip [m]: 0.01° and 0.01 mm, below which no run tells anything.
_LEAST = {"angle": np.deg2rad(0.01), "tip": 1e-5}
# Unit of the moment on the base in the regression [N m].
_MOMENT = 1e-3
# Round-off of a sum of weights.
_ROUND_OFF = 1e-9


class BoundError(ValueError):
    """Error for runs that tell no bound."""


@dataclass(frozen=True)
class ErrorScale:
    """Scale of an error: values at the nodes, and growth with the moment on the base."""

    at_nodes: Float[np.ndarray, " nodes"]
    per_moment: float

    def at(self, verdict: Verdict) -> Float[np.ndarray, " n"]:
        """Return the scale of each state."""
        along = np.interp(verdict.rod_angle, NODES, self.at_nodes)
        return along + self.per_moment * verdict.base_moment


def scales(verdict: Verdict) -> dict[str, ErrorScale]:
    """Return the scales of ``angle`` [rad] and ``tip`` [m], from the fit runs.

    Raises
    ------
    BoundError
        If there are fewer states of fit runs than numbers to fit.
    """
    chosen = _told(verdict, "fit")
    if chosen.sum() <= len(NODES):
        raise BoundError(
            f"truth: got {chosen.sum()} states of fit runs inside the rods' domains, expected more than "
            f"{len(NODES)}"
        )
    return {name: _regression(verdict, chosen, values, name) for name, values in _errors(verdict).items()}


def _regression(
    verdict: Verdict, chosen: Bool[np.ndarray, " n"], errors: Float[np.ndarray, " n"], name: str
) -> ErrorScale:
    """Return the scale by least squares, with bounds on the unknowns.

    These are the first node's value, the rises to the next ones, none negative, and the growth with the
    moment.
    """
    rises = [np.interp(verdict.rod_angle[chosen], pair, (0.0, 1.0)) for pair in pairwise(NODES)]
    moment = verdict.base_moment[chosen] / _MOMENT
    design = np.stack([np.ones(int(chosen.sum())), *rises, moment], axis=1)
    least = [_LEAST[name], *[0.0] * len(rises), _MOMENT * _least_slope(verdict, chosen, name)]
    found = lsq_linear(design, errors[chosen], (least, np.inf), method="bvls")
    if not found.success:
        raise BoundError(f"{name}: the regression of its scale failed: {found.message}")
    return ErrorScale(np.cumsum(found.x[:-1]), float(found.x[-1]) / _MOMENT)


def _least_slope(verdict: Verdict, chosen: Bool[np.ndarray, " n"], name: str) -> float:
    """Return the relative error of free bending times the response of the rod at rest to a moment.

    The relative error is the mean of that of θ over the unloaded states, the response that of the tip's way
    or of θ to a tip force, by the moment on the base.
    """
    free = chosen & ~verdict.loaded & (verdict.angle >= _BENT)
    if not free.any():
        return 0.0
    relative = float(np.mean(verdict.angle_off[free] / verdict.angle[free]))
    response = verdict.turn_by_moment if name == "angle" else verdict.way_by_moment
    return relative * float(np.median(response[free]))


def bound_for(
    verdict: Verdict, scale: dict[str, ErrorScale], layout: Layout
) -> tuple[ErrorBound, dict[str, Any]]:
    """Return the bound of a layout's calibration, and its provenance.

    Parameters
    ----------
    verdict : rods of all calibrations against the truth.
    scale : result of `scales`.
    layout : layout of the calibration, whose judge states are left out.

    Raises
    ------
    BoundError
        If no other layout has a judged state.
    """
    told = _told(verdict, "judge")
    own = np.array([one is not None and same_layout(one, layout) for one in verdict.served_by])
    others = told & ~own
    names = np.array([title(one) if one is not None else "" for one in verdict.served_by], dtype=object)
    counts = {name: int((names[others] == name).sum()) for name in sorted(set(names[others]))}
    if not counts:
        raise BoundError(f"truth: got no judge states of other layouts than {title(layout)}, expected some")
    factor = {
        name: _factors(
            errors[others] / scale[name].at(verdict)[others], names[others], verdict.rod_angle[others]
        )
        for name, errors in _errors(verdict).items()
    }
    raised = {
        name: np.maximum.accumulate(np.array(at_nodes) * scale[name].at_nodes)
        for name, at_nodes in factor.items()
    }
    (angle, angle_by_bend), (tip, tip_by_bend) = (
        (float(values[0]), tuple((values - values[0]).tolist()))
        for values in (raised["angle"], raised["tip"])
    )
    bound = ErrorBound(
        pressure_sum=(0.0,),
        angle=(angle,),
        tip=(tip,),
        angle_per_moment=max(factor["angle"]) * scale["angle"].per_moment,
        tip_per_moment=max(factor["tip"]) * scale["tip"].per_moment,
        bending_angle=tuple(map(float, NODES)),
        angle_by_bend=angle_by_bend,
        tip_by_bend=tip_by_bend,
    )
    note = {
        "level": LEVEL,
        "scale_from": {"role": "fit", "states": int(_told(verdict, "fit").sum())},
        "judge_states_of_other_layouts": counts,
        "states_of_unknown_mesh_limit": int((others & ~verdict.mesh_known).sum()),
        "factor": factor,
        "own_judge_states": coverage(verdict, bound, told & own),
    }
    return bound, note


def coverage(verdict: Verdict, bound: ErrorBound, rows: Bool[np.ndarray, " n"]) -> dict[str, Any]:
    """Return how many states there are, and the shares of them whose angle and tip a bound covers."""
    stated = bound.at(
        verdict.pressure[rows].sum(axis=1), verdict.base_moment[rows], bending_angle=verdict.rod_angle[rows]
    )
    return _shares(verdict, rows, *map(np.asarray, stated))


def coverage_by(verdict: Verdict, role: str = "judge") -> dict[str, Any]:
    """Return the shares of states that the rods' own bounds cover, and the bound's median at low pressures.

    Images of earlier states are left out, and errors are against the limit of fine meshes.

    Returns
    -------
    shares : ``all``; ``layouts`` by title of the calibration; ``fifths`` of the pressures' sum; each has
        ``states`` and the shares ``angle`` and ``tip`` (None where no bound of the tip is stated).
        ``median_bound_below_30_kpa_deg`` is that of the angle.
    """
    told = _told(verdict, role)
    total = verdict.pressure.sum(axis=1)
    titles = np.array([title(one) if one is not None else "" for one in verdict.served_by], dtype=object)
    result: dict[str, Any] = {
        "all": _stated(verdict, told),
        "layouts": {name: _stated(verdict, told & (titles == name)) for name in dict.fromkeys(titles[told])},
        "fifths": [],
    }
    if told.any():
        edges = np.quantile(total[told], [0.2, 0.4, 0.6, 0.8])
        fifth = np.searchsorted(edges, total, side="left")
        for k in range(5):
            rows = told & (fifth == k)
            ends = [float(1e-3 * of(total[rows])) for of in (np.min, np.max)] if rows.any() else []
            result["fifths"].append({"pressure_sum_kpa": ends, **_stated(verdict, rows)})
    low = told & (total < 30e3)
    if low.any():
        result["median_bound_below_30_kpa_deg"] = float(np.rad2deg(np.median(verdict.stated[low])))
    return result


def _stated(verdict: Verdict, rows: Bool[np.ndarray, " n"]) -> dict[str, Any]:
    return _shares(verdict, rows, verdict.stated[rows], verdict.stated_tip[rows])


def _shares(
    verdict: Verdict,
    rows: Bool[np.ndarray, " n"],
    angle: Float[np.ndarray, " m"],
    tip: Float[np.ndarray, " m"],
) -> dict[str, Any]:
    def share(errors: np.ndarray, bounds: np.ndarray) -> float | None:
        known = np.isfinite(bounds)
        return float((errors[known] <= bounds[known]).mean()) if known.any() else None

    return {
        "states": int(rows.sum()),
        "angle": share(verdict.angle_off[rows], angle),
        "tip": share(verdict.tip_off[rows], tip),
    }


def _errors(verdict: Verdict) -> dict[str, Float[np.ndarray, " n"]]:
    return {"angle": verdict.angle_off, "tip": verdict.tip_off}


def _told(verdict: Verdict, role: str) -> Bool[np.ndarray, " n"]:
    """Return which states of a role count: judged, no other's image, on a mesh that the study knows."""
    told: np.ndarray = verdict.judged & (verdict.role == role) & ~verdict.copied
    return told & np.isfinite(verdict.angle_off)


def _factors(
    scores: Float[np.ndarray, " n"], layouts: np.ndarray, angle: Float[np.ndarray, " n"]
) -> list[float]:
    """Return the factor at each node: the larger one of the quarters beside it, each at least that of all."""

    def of(rows: Bool[np.ndarray, " n"]) -> float:
        counts = {name: int((layouts[rows] == name).sum()) for name in set(layouts[rows])}
        weights = np.array([1.0 / (len(counts) * counts[name]) for name in layouts[rows]])
        return _quantile(scores[rows], weights)

    everywhere, quarters = of(np.ones(len(scores), dtype=bool)), []
    for number, (low, high) in enumerate(pairwise(NODES)):
        last = number == len(NODES) - 2
        rows = (angle >= low) & ((angle < high) | last)
        quarters.append(max(everywhere, of(rows)) if rows.any() else everywhere)
    return [max(quarters[max(node - 1, 0) : node + 1]) for node in range(len(NODES))]


def _quantile(scores: Float[np.ndarray, " n"], weights: Float[np.ndarray, " n"]) -> float:
    """Return the least score below which, itself included, lies a weight of `LEVEL`."""
    order = np.argsort(scores)
    reached = int(np.searchsorted(np.cumsum(weights[order]), LEVEL - _ROUND_OFF))
    return float(scores[order][min(reached, len(scores) - 1)])
