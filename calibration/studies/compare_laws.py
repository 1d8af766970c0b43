"""Comparison of candidate section laws: held-out error and evaluation time."""

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from calibration.fit import Metric, Samples, Scales, figures, fit, prepare
from calibration.progress import progress_bar
from calibration.studies.other_laws import fit_polynomial, network_law
from rodmodel import Domain, SectionLaw

DEGREES = (4, 6, 8)
REPEATS = 2000


@dataclass(frozen=True)
class Row:
    """Size, held-out errors (from `held_out_error.figures`) and evaluation times [s] of a candidate."""

    name: str
    parameters: int
    figures: dict[str, Any]
    evaluation_seconds: float
    free_curvature_seconds: float


def compare(
    shipped: SectionLaw,
    train: Samples,
    held_out: Samples,
    metric: Metric,
    scales: Scales,
    length: float,
    iterations: int,
    seed: int,
    watch: Callable[[str, int, float], None],
) -> list[Row]:
    """Fit the other candidates to the same training states, and compare all at the same held-out ones.

    Parameters
    ----------
    shipped : fitted network of ridges.
    train, held_out : training and held-out states.
    metric, scales : metric of the training states, and scales of the laws.
    length : body length for the bending angle [m].
    iterations : iterations of the network's training.
    seed : seed of the network.
    watch : callback for the progress.
    """
    laws: list[tuple[str, SectionLaw]] = []
    for degree in DEGREES:
        laws.append(
            (f"polynomial of degree {degree} in (u, p)", fit_polynomial(train, metric, scales, degree))
        )
        watch(f"polynomial {degree}", 1, 0.0)
    start = network_law(scales, seed)
    network = fit(start, train, metric, iterations, watch=lambda n, loss: watch("network", n, loss))
    laws.append(("tanh network 6–24–24–1 in (u, p)", network.law))
    laws.append(("network of ridges", shipped))
    return [_row(name, law, held_out, length) for name, law in laws]


def _row(name: str, law: SectionLaw, held_out: Samples, length: float) -> Row:
    pressure, curvature = jnp.asarray(held_out.pressure[0]), jnp.asarray(held_out.curvature[0])
    at = eqx.filter_jit(law.at)(pressure)
    return Row(
        name=name,
        parameters=sum(
            int(jnp.count_nonzero(x)) for x in jax.tree.leaves(eqx.filter(law, eqx.is_inexact_array))
        ),
        figures=figures(law, held_out, length, from_cell=True),
        evaluation_seconds=_per_curvature(at, curvature),
        free_curvature_seconds=_median_seconds(eqx.filter_jit(law.free_curvature), pressure),
    )


def _per_curvature(at: Any, curvature: jax.Array, batch: int = 1000) -> float:
    """Return the time for moment and stiffness at one curvature, at fixed pressures, in a batch."""
    states = curvature * jnp.linspace(0.5, 1.0, batch)[:, None]
    both = eqx.filter_jit(lambda at, u: jax.vmap(lambda u: (at.moment(u), at.stiffness(u)))(u))
    return _median_seconds(lambda u: both(at, u), states, REPEATS // 20) / batch


def _median_seconds(function: Callable[..., Any], argument: jax.Array, repeats: int = REPEATS) -> float:
    jax.block_until_ready(function(argument))  # compiles
    times = []
    for _ in range(repeats):
        clock = time.perf_counter()
        jax.block_until_ready(function(argument))
        times.append(time.perf_counter() - clock)
    return statistics.median(times)


def markdown(rows: Sequence[Row]) -> str:
    """Return the comparison as a table, with median / 95th percentile / worst of each error."""
    lines = [
        "| law | parameters | moment [N mm] | free-bending angle over 60 mm [deg] | loaded angle [deg] "
        "| volume [% of range] | moment + stiffness [ns] | free curvature [µs] |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        f = row.figures
        cells = [
            row.name,
            f"{row.parameters}",
            _three(f["moment_nm"], 1e3, ".3f"),
            _three(f["free_bending_vector_rad"], np.rad2deg(1.0), ".2f"),
            _three(f["loaded_bending_vector_rad"], np.rad2deg(1.0), ".2f"),
            _three(f["volume_m2"], 100.0 / f["volume_m2"]["range"], ".2f"),
            f"{1e9 * row.evaluation_seconds:.0f}",
            f"{1e6 * row.free_curvature_seconds:.1f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _three(figure: dict[str, Any], unit: float, form: str) -> str:
    return " / ".join(f"{figure[name] * unit:{form}}" for name in ("median", "p95", "worst"))


def compare_candidates(
    law: SectionLaw, dataset: xr.Dataset, domain: Domain, length: float, iterations: int, seed: int
) -> str:
    """Return a table of the law and other forms of it, all trained on the same states."""
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
