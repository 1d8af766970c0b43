"""Markdown table of a calibration's held-out errors."""

from collections.abc import Mapping
from typing import Any

import numpy as np

# key in the calibration's "error", name, unit, factor to it
_ROWS = (
    ("free_bending_angle_rad", "free-bending angle", "deg", np.rad2deg(1.0)),
    ("free_bending_vector_rad", "free-bending angle and plane", "deg", np.rad2deg(1.0)),
    ("loaded_bending_angle_rad", "bending angle under moment", "deg", np.rad2deg(1.0)),
    ("loaded_bending_vector_rad", "bending angle and plane under moment", "deg", np.rad2deg(1.0)),
    ("moment_nm", "moment at given curvature", "N mm", 1e3),
    ("volume_m2", "chamber volume per length", "mm²", 1e6),
)


def error_table(error: Mapping[str, Any]) -> str:
    """Return median, 95th percentile, worst, range, and load of the worst as a Markdown table.

    Parameters
    ----------
    error : held-out errors from `calibration.fit.held_out_error.figures`.
    """
    lines = [
        f"{error['states']} held-out states on {error['paths']} paths; angles over the body's length.",
        "",
        "| error of | states | median | 95 % | worst | range | 95 % / range | worst at (kPa; N mm) |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for key, name, unit, factor in _ROWS:
        if key not in error:
            continue
        row = error[key]
        pressure = " ".join(f"{p / 1e3:.1f}" for p in row["worst_at"]["pressure_pa"])
        moment = " ".join(f"{1e3 * m:.2f}" for m in row["worst_at"]["moment_nm"])
        share = 100.0 * row["p95"] / row["range"] if row["range"] > 0 else float("nan")
        cells = [
            f"{name} [{unit}]",
            f"{row['states']}",
            *(f"{factor * row[figure]:.3g}" for figure in ("median", "p95", "worst")),
            f"{factor * row['range']:.4g}",
            f"{share:.2f} %",
            f"{pressure}; {moment}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"
