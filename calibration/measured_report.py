"""What a fit to measurements found: a record, a table and a picture of the residuals."""

import math
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from calibration.adjusted_law import NAMES, default_parameters
from calibration.measured import POSITIONS, Measured
from calibration.measured_fit import MeasuredFit
from calibration.plots import DOTS_PER_INCH

# For people: unit and factor to it.
_UNITS = tuple(("kPa", 1e-3) if "offset" in name else ("", 1.0) for name in NAMES)


def fit_record(fit: MeasuredFit, measured: Measured) -> dict[str, Any]:
    """Parameters, what is held and why, and residuals, as a JSON object; offsets in kPa."""
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
            for name, before, after in zip(measured.outputs, *_rms(fit, measured), strict=True)
        ],
        "rows": len(measured.lines),
        "noise_scale": fit.noise_scale,
        "reduced_chi_square_of_map": fit.chi_square[0],
        "reduced_chi_square": fit.chi_square[1],
        "rows_beyond_the_map": fit.extrapolated,
        "converged": True,
    }


def fit_text(fit: MeasuredFit, measured: Measured) -> str:
    """Result for people."""
    held = {h.name for h in fit.held}
    lines = [f"{'parameter':26s} {'value':>9s} {'std error':>10s}   95 % interval"]
    for n, (name, (unit, factor)) in enumerate(zip(NAMES, _UNITS, strict=True)):
        label = f"{name} [{unit}]" if unit else name
        value = factor * fit.parameters[n]
        if name in held:
            lines.append(f"{label:26s} {value:9.4f}       held at its default")
            continue
        low, high = factor * fit.interval[n]
        changed = " *" if not low <= factor * default_parameters()[n] <= high else ""
        lines.append(
            f"{label:26s} {value:9.4f} {factor * fit.standard_error[n]:10.4f}   "
            f"{low:.4f} to {high:.4f}{changed}"
        )
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
    for name, before, after in zip(measured.outputs, *_rms(fit, measured), strict=True):
        lines.append(f"{name:20s} {before:15.3f} {after:13.3f}")
    lines.append(
        f"weighted squares over degrees of freedom: {fit.chi_square[0]:.3g} of the map, "
        f"{fit.chi_square[1]:.3g} adjusted; 1 is what the given noise explains"
    )
    if fit.extrapolated:
        lines.append(f"{fit.extrapolated} of {len(measured.lines)} rows lie beyond the map when adjusted")
    return "\n".join(lines)


def write_residual_plot(fit: MeasuredFit, measured: Measured, file: Path) -> None:
    """Write the picture of [`residual_plot`][]."""
    figure = residual_plot(fit, measured)
    figure.savefig(file, dpi=DOTS_PER_INCH)
    plt.close(figure)


def residual_plot(fit: MeasuredFit, measured: Measured) -> Figure:
    """Measured less predicted over the bending angle, map and adjusted, on the band of the noise."""
    count = len(measured.outputs)
    columns = min(count, 3)
    rows = -(-count // columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(4.4 * columns, 3.2 * rows), layout="constrained", squeeze=False
    )
    angle = np.degrees(fit.angle)
    order = np.argsort(angle)
    for n, (axis, name) in enumerate(zip(axes.flat, measured.outputs, strict=False)):
        unit = _unit(name)
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
            ylabel=f"measured − predicted [{'mm' if name in POSITIONS else 'deg'}]",
            ylim=(-reach, reach),
        )
    for axis in axes.flat[count:]:
        axis.set_axis_off()
    figure.legend(*axes.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _rms(fit: MeasuredFit, measured: Measured) -> tuple[list[float], list[float]]:
    units = np.array([_unit(name) for name in measured.outputs])
    before, after = (units * np.sqrt(np.mean(off**2, axis=0)) for off in (fit.of_map, fit.adjusted))
    return before.tolist(), after.tolist()


def _unit(name: str) -> float:
    return 1e3 if name in POSITIONS else math.degrees(1.0)
