"""Held-out errors of a law, and its plots."""

from pathlib import Path
from typing import Any

import xarray as xr

from calibration.fit import AnyLaw, deviations, figures, loading_samples, prepare
from calibration.report.law_plots import write_figures
from calibration.sweep import inside
from rodmodel import Domain


def judge(
    law: AnyLaw, dataset: xr.Dataset, domain: Domain, length: float, figures_in: Path | None
) -> dict[str, Any]:
    """Return the held-out errors of a law, and write plots if ``figures_in`` is a directory."""
    held_out = prepare(dataset, domain, length).held_out
    if figures_in is not None:
        samples = loading_samples(dataset)
        everything = samples.where(inside(domain, samples.pressure, samples.moment))
        write_figures(figures_in, law, everything, held_out, deviations(law, held_out, length), length)
    return figures(law, held_out, length)
