"""From a dataset to a judged law: the steps that the command line runs."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from calibration.compare import compare, markdown
from calibration.dataset import attributes
from calibration.design import MOMENT_STEPS, inside
from calibration.error import deviations, figures
from calibration.fit import SIZES, STARTS, TRIAL_ITERATIONS, choose_size, fit_expansion
from calibration.plots import write_figures
from calibration.progress import progress_bar
from calibration.samples import Metric, Samples, loading_samples, metric
from calibration.start import Scales, initial_law
from rodmodel import Domain, FreeStateExpansion, SectionLaw


@dataclass(frozen=True)
class Judged:
    """A fitted law with its held-out figures, or why there is none."""

    law: FreeStateExpansion
    error: dict[str, Any]
    training: dict[str, Any]
    states: int
    good: bool
    complaint: str


@dataclass(frozen=True)
class Material:
    """Training states, held-out states inside the domain, and the scales of a fit."""

    train: Samples
    held_out: Samples
    metric: Metric
    scales: Scales


def prepare(dataset: xr.Dataset, domain: Domain, length: float) -> Material:
    """Split a dataset by role; training keeps states beyond a narrowed domain, which support its edge."""
    samples = loading_samples(dataset)
    train = samples.where(~samples.held_out)
    held_out = samples.where(samples.held_out & inside(domain, samples.pressure, samples.moment))
    return Material(
        train, held_out, _metric(train, dataset, domain, length), Scales.of(train, domain.moment_max)
    )


def _metric(samples: Samples, dataset: xr.Dataset, domain: Domain, length: float) -> Metric:
    return metric(samples, length, attributes(dataset)["pressure_step"], domain.moment_max / MOMENT_STEPS)


def fit_and_judge(
    dataset: xr.Dataset, domain: Domain, length: float, hidden: int | None, iterations: int, seed: int
) -> Judged:
    """Fit the free-state expansion to the training states and measure it on the held-out ones.

    Parameters
    ----------
    dataset : of a run.
    domain : inside which the error is measured.
    length : of the body whose bending angle counts [m].
    hidden : hidden units a layer; None chooses them on training paths that are set aside.
    iterations : of the final training.
    seed : of the first start.
    """
    material = prepare(dataset, domain, length)
    mirror = bool(attributes(dataset)["mirror"])

    def start(size: int, seed: int) -> FreeStateExpansion:
        return initial_law(material.train, material.scales, size, seed, mirror)

    trials: tuple[Any, ...] = ()
    total = (0 if hidden else len(SIZES)) * TRIAL_ITERATIONS + STARTS * TRIAL_ITERATIONS + iterations
    with progress_bar(total, "iterations") as advance:

        def watch(stage: str, _: int, loss: float) -> None:
            advance(1, f"{stage}, loss {loss:.3g}")

        if hidden is None:
            hidden, trials = choose_size(
                material.train,
                lambda some: _metric(some, dataset, domain, length),
                start,
                seed=seed,
                watch=watch,
            )
        chosen = hidden
        found = fit_expansion(
            material.train,
            material.metric,
            lambda seed: start(chosen, seed),
            iterations,
            seed=seed,
            watch=watch,
        )
    error = figures(found.law, material.held_out, length)
    training = {
        "hidden": hidden,
        "iterations": found.iterations,
        "mean_square_residual": found.loss,
        "states": len(material.train),
        "paths": len(np.unique(material.train.path)),
        "seed": seed,
        "sizes_tried": [asdict(trial) for trial in trials],
    }
    complaint = ""
    if not found.regular:
        complaint = f"the minimiser gave up after {found.iterations} iterations at a loss of {found.loss:.3g}"
    elif not all(np.isfinite(row["worst"]) for row in error.values() if isinstance(row, dict)):
        complaint = "the fitted law has no equilibrium at some held-out states"
    return Judged(
        found.law, error, training, len(material.train) + len(material.held_out), not complaint, complaint
    )


def judge(
    law: SectionLaw, dataset: xr.Dataset, domain: Domain, length: float, figures_in: Path | None
) -> dict[str, Any]:
    """Held-out figures of a law, and the figures for people if a directory is given."""
    held_out = prepare(dataset, domain, length).held_out
    if figures_in is not None:
        samples = loading_samples(dataset)
        everything = samples.where(inside(domain, samples.pressure, samples.moment))
        write_figures(figures_in, law, everything, held_out, deviations(law, held_out, length), length)
    return figures(law, held_out, length)


def compare_candidates(
    law: SectionLaw, dataset: xr.Dataset, domain: Domain, length: float, iterations: int, seed: int
) -> str:
    """Table of the law against other forms of it, all trained on the same states."""
    material = prepare(dataset, domain, length)
    with progress_bar(iterations, "iterations") as advance:
        rows = compare(
            law,
            material.train,
            material.held_out,
            material.metric,
            material.scales,
            length,
            iterations,
            seed,
            lambda stage, _, loss: advance(1, f"{stage}, loss {loss:.3g}"),
        )
    return markdown(rows)
