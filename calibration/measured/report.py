"""Report of a fit to measurements: record, table and plot of the residuals."""

import math
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from calibration.measured.adjusted_law import NAMES, default_parameters
from calibration.measured.fit import MeasuredFit
from calibration.measured.states import unit_of
from calibration.report import DOTS_PER_INCH
from rodmodel.io import atomic_part

# Unit of each parameter in reports, and the factor to it.
_UNITS = tuple(("kPa", 1e-3) if "offset" in name else ("", 1.0) for name in NAMES)


def fit_record(fit: MeasuredFit) -> dict[str, Any]:
    """Return parameters, held ones with the reason, residuals and doubts for JSON; offsets in kPa."""
    measured = fit.repeats.measured
    held = {h.name: h for h in fit.held}
    parameters = []
    for n, (name, (unit, factor)) in enumerate(zip(NAMES, _UNITS, strict=True)):
        row: dict[str, Any] = {"name": f"{name}_kpa" if unit else name}
        row["value"] = factor * float(fit.parameters[n])
        row["held"] = name in held
        row["standard_error"] = None if name in held else factor * float(fit.standard_error[n])
        ends = (factor * fit.interval[n]).tolist()
        row["interval_95"] = None if name in held else [end if math.isfinite(end) else None for end in ends]
        parameters.append(row)
    return {
        "parameters": parameters,
        "not_identifiable": [
            {
                "held": h.name,
                "combination": h.combination,
                "uncertainty_over_plausible": h.uncertainty if math.isfinite(h.uncertainty) else None,
            }
            for h in fit.held
        ],
        "residuals": [
            {"column": name, "rms_of_map": before, "rms_adjusted": after}
            for name, before, after in zip(measured.outputs, *_rms(fit), strict=True)
        ],
        "repeats_scatter": {
            name: float(scatter) * unit_of(name)[1]
            for name, scatter in zip(measured.outputs, fit.repeats.scatter, strict=True)
            if math.isfinite(scatter)
        },
        "rows": fit.repeats.rows,
        "states": len(measured.lines),
        "rows_passed_over": list(measured.passed_over),
        "noise_scale": fit.noise_scale,
        "reduced_chi_square_of_map": fit.chi_square[0],
        "reduced_chi_square": fit.chi_square[1],
        "rows_beyond_the_map": fit.extrapolated,
        "doubts": list(fit.doubts),
        "converged": not fit.doubts,
    }


def fit_text(fit: MeasuredFit) -> str:
    """Return the fit as a table."""
    measured = fit.repeats.measured
    held = {h.name for h in fit.held}
    lines = [f"{'parameter':26s} {'value':>9s} {'std error':>10s}   95 % interval"]
    for n, (name, (unit, factor)) in enumerate(zip(NAMES, _UNITS, strict=True)):
        label = f"{name} [{unit}]" if unit else name
        value = factor * fit.parameters[n]
        if name in held:
            lines.append(f"{label:26s} {value:9.4f}       held at its default")
            continue
        error = factor * fit.standard_error[n]
        low, high = factor * fit.interval[n]
        if math.isnan(low):
            lines.append(f"{label:26s} {value:9.4f} {error:10.4f}   not computed")
            continue
        changed = " *" if not low <= factor * default_parameters()[n] <= high else ""
        lines.append(f"{label:26s} {value:9.4f} {error:10.4f}   {low:.4f} to {high:.4f}{changed}")
    lines.append("* the map's own value is outside the interval")
    for h in fit.held:
        if len(h.combination) == 1:
            depend = "hardly depend" if math.isfinite(h.uncertainty) else "do not depend"
            what = f"the data {depend} on {h.name}"
        else:
            terms = " ".join(f"{share:+.2f} {name}" for name, share in h.combination.items())
            what = f"the data cannot tell apart {terms} (each in units of its plausible spread)"
        lines.append(f"held {h.name}: {what}")
    lines += ["", f"{'column':20s} {'rms of the map':>15s} {'rms adjusted':>13s}"]
    for name, before, after in zip(measured.outputs, *_rms(fit), strict=True):
        lines.append(f"{name:20s} {before:15.3f} {after:13.3f}")
    lines.append(
        f"weighted squares over degrees of freedom: {fit.chi_square[0]:.3g} of the map, "
        f"{fit.chi_square[1]:.3g} adjusted; 1 is what the given noise explains"
    )
    if fit.repeats.rows > len(measured.lines):
        scatter = ", ".join(
            f"{name} {unit_of(name)[1] * size:.2g}"
            for name, size in zip(measured.outputs, fit.repeats.scatter, strict=True)
        )
        lines.append(
            f"{fit.repeats.rows} rows of {len(measured.lines)} states, each counted once; standard deviation "
            f"about a state's mean: {scatter}"
        )
    if fit.extrapolated:
        lines.append(f"{fit.extrapolated} of {len(measured.lines)} states lie beyond the map when adjusted")
    return "\n".join(lines)


def write_residual_plot(fit: MeasuredFit, file: Path) -> None:
    """Write the plot of [`residual_plot`][]."""
    figure = residual_plot(fit)
    with atomic_part(file) as part:
        figure.savefig(part, dpi=DOTS_PER_INCH, format=file.suffix.lower().removeprefix("."))
    plt.close(figure)


def residual_plot(fit: MeasuredFit) -> Figure:
    """Plot the residuals of map and adjusted law over the bending angle, on the band of the noise."""
    measured = fit.repeats.measured
    count = len(measured.outputs)
    columns = min(count, 3)
    rows = -(-count // columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(4.4 * columns, 3.2 * rows), layout="constrained", squeeze=False
    )
    angle = np.degrees(fit.angle)
    order = np.argsort(angle)
    for n, (axis, name) in enumerate(zip(axes.flat, measured.outputs, strict=False)):
        named, unit = unit_of(name)
        sigma = fit.noise_scale * unit / fit.weight[order, n]
        before, after = unit * fit.of_map[:, n], unit * fit.adjusted[:, n]
        reach = 1.1 * max(np.abs(before).max(), np.abs(after).max(), 2.0 * sigma.min())
        axis.fill_between(
            angle[order], -2.0 * sigma, 2.0 * sigma, color="0.88", lw=0, label="noise, ±2 standard deviations"
        )
        axis.axhline(0.0, color="0.6", lw=0.8)
        axis.plot(angle, before, "o", mfc="none", mec="C1", ms=5, label="map as shipped")
        axis.plot(angle, after, "o", color="C0", ms=4, label="adjusted")
        axis.set(
            title=name,
            xlabel="predicted bending angle [deg]",
            ylabel=f"measured − predicted [{named}]",
            ylim=(-reach, reach),
        )
    for axis in axes.flat[count:]:
        axis.set_axis_off()
    figure.legend(*axes.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _rms(fit: MeasuredFit) -> tuple[list[float], list[float]]:
    units = np.array([unit_of(name)[1] for name in fit.repeats.measured.outputs])
    before, after = (units * np.sqrt(np.mean(off**2, axis=0)) for off in (fit.of_map, fit.adjusted))
    return before.tolist(), after.tolist()
