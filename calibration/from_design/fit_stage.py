"""Stage 5: the section law, fitted near a shipped law that is scaled to the design, or from scratch."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from calibration.fit import Judged, begin_near, calibration_of, fit_and_judge, prepare
from calibration.from_design.near_law import NearLaw
from calibration.from_design.stage_record import StageError, key_of
from calibration.from_design.task import Task
from calibration.provenance import code_version, sha256, today
from calibration.similar import rescaled
from calibration.sweep import attributes
from rodmodel import Calibration, Domain, read_calibration, save_calibration

# Size of a law from scratch, as of `rodmodel-calibrate fit`, and from which number of states on it is tried.
_RIDGES, _FEATURES = 24, 16
_ENOUGH = 500
# Weights with which a fit stays near the similar law. Held-out states choose.
_NEAR, _STIFF = 0.03, 3.0
# A law whose domain is narrower than another's by more than this does not win by its errors there.
_NARROW = 0.9
ITERATIONS = 100


@dataclass(frozen=True)
class Start:
    """A law to begin with: near a shipped one, or none.

    Parameters
    ----------
    title : in words.
    near : similar law; None from scratch.
    stay : weight with which the fit stays near it; infinite if its scales alone are fitted.
    """

    title: str
    near: NearLaw | None
    stay: float = _NEAR

    def law(self, run: Mapping[str, Any]) -> Any:
        """Return the initial law with the symmetry of a run's section.

        Raises
        ------
        ValueError
            If the shipped law has a symmetry that the section has not.
        """
        return None if self.near is None else begin_near(self.near.calibration.section_law, dict(run))


def starts_for(task: Task, near: Sequence[NearLaw], run: Mapping[str, Any], states: int) -> list[Start]:
    """Return where fits begin: near the most similar law that can; and from scratch too, if that is cheap.

    States tell less than a network has numbers, and still how it differs from a similar law, or that one's
    scales. So laws that stay closer to that one are candidates too.
    """
    found = []
    for one in near:
        start = Start(f"near {one.title}", one)
        try:
            start.law(run)
        except ValueError:
            continue
        found.append(start)
        found.append(Start(f"close to {one.title}", one, _STIFF))
        found.append(Start(f"{one.title}, its scales alone", one, math.inf))
        break
    if not found or (task.budget.converged and states >= _ENOUGH):
        found.append(Start("from scratch", None))
    return found


def fitted(
    task: Task, dataset: xr.Dataset, file: Path, domain: Domain, near: Sequence[NearLaw], iterations: int
) -> Calibration:
    """Return the law with the least held-out error, as a calibration without ends.

    It is kept in a file, and read from there if that is of the same sweep.

    Parameters
    ----------
    task : calibration to make.
    dataset, file : the sweep.
    domain : of the law; it is narrowed until the law is stable.
    near : shipped laws, the most similar first.
    iterations : of each fit.

    Raises
    ------
    StageError
        If no fit gives a usable law.
    """
    run, checksum = attributes(dataset), sha256(file)
    made = task.directory / f"law-{key_of({'dataset': checksum, 'iterations': iterations})}.json"
    if made.exists():
        try:
            return read_calibration(made)
        except ValueError:
            # Damaged: it is fitted again.
            pass
    length, outcomes = run["geometry"]["body_length"], []
    states, scaled = prepare(dataset, domain, length), dict[str, Any]()
    for start in starts_for(task, near, run, dataset.sizes["state"]):
        # Several begin with one similar law, whose scales are fitted once.
        if start.near is not None and start.near.title not in scaled:
            scaled[start.near.title] = rescaled(start.law(run), states.train, states.metric)
        laws = [] if start.near is None else [scaled[start.near.title]]
        steps, stay = (0, _NEAR) if start.stay == math.inf else (iterations, start.stay)
        outcome = fit_and_judge(dataset, domain, length, _RIDGES, _FEATURES, steps, 0, near=laws, stay=stay)
        outcomes.append((start, outcome))
    good = [(start, outcome) for start, outcome in outcomes if outcome.good]
    if not good:
        raise StageError(
            f"fit: {outcomes[0][1].complaint}, expected a law that has one; a longer budget may help"
        )
    start, best = best_of(good)
    provenance = {
        "fit_command": task.command,
        "code_version": code_version(),
        "dataset_sha256": checksum,
        "states": best.states,
        "date": today(),
        "training": best.training,
        "fit_start": start.title,
        "held_out_by_start_rad": {one.title: held_out(outcome.error) for one, outcome in good},
        **({} if start.near is None else {"near_deviations": dict(start.near.deviations)}),
    }
    calibration = calibration_of(best.law, best.domain, best.error, run, provenance)
    save_calibration(calibration, made)
    return calibration


def best_of(outcomes: Sequence[tuple[Start, Judged]]) -> tuple[Start, Judged]:
    """Return the law with the least held-out error among those whose domain is about the widest."""
    widest = np.max([_extent(outcome.domain) for _, outcome in outcomes], axis=0)
    wide = [pair for pair in outcomes if np.all(_extent(pair[1].domain) >= _NARROW * widest)]
    return min(wide or outcomes, key=lambda pair: held_out(pair[1].error))


def _extent(domain: Domain) -> np.ndarray:
    """Return the largest pressure of a chamber, and the largest sum [Pa]."""
    return np.array([max(domain.pressure_max), domain.pressure_sum_max], float)


def held_out(error: Mapping[str, Any]) -> float:
    """Return the 95th percentile of the held-out angle [rad]: in free bending, or under moments alone."""
    for name in ("free_bending_angle_rad", "loaded_bending_angle_rad"):
        if name in error:
            return float(error[name]["p95"])
    return float("inf")
