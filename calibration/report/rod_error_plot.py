"""Plot of the rods' errors on the runs of the full actuator."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from calibration.report.law_plots import DOTS_PER_INCH
from calibration.truth import Verdict
from rodmodel.io import atomic_part


def write_truth_figure(verdict: Verdict, file: Path) -> None:
    """Plot errors of tip and θ over θ for judge runs, by the number of pressurised chambers and loads.

    Parameters
    ----------
    verdict : result of `calibration.truth.compare_rods.compare_with_truth`.
    file : PNG file; its directory is created if missing.
    """
    judged = verdict.judged & (verdict.role == "judge")
    driven = (verdict.pressure > 0.0).sum(axis=1)
    groups = [
        ("one chamber", ~verdict.loaded & (driven == 1), "C0o"),
        ("two chambers", ~verdict.loaded & (driven == 2), "C1s"),
        ("three chambers", ~verdict.loaded & (driven == 3), "C2^"),
        ("tip force, gravity", verdict.loaded, "C3x"),
    ]
    angle = np.rad2deg(verdict.angle)
    figure, (tips, angles) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
    for name, members, style in groups:
        rows = judged & members
        tips.plot(angle[rows], 100.0 * verdict.tip[rows], style, ms=5, label=name)
        angles.plot(angle[rows], np.rad2deg(verdict.angle_error[rows]), style, ms=5)
    rows = np.flatnonzero(judged)[np.argsort(angle[judged])]
    angles.plot(angle[rows], np.rad2deg(verdict.stated[rows]), "k_", ms=7, label="stated 90 % bound")
    tips.set(xlabel="bending angle of the full actuator [deg]", ylabel="tip, off by [% of length]")
    angles.set(xlabel="bending angle of the full actuator [deg]", ylabel="bending angle, off by [deg]")
    # Margin for the legend, which would cover states.
    angles.margins(y=0.12)
    tips.legend()
    angles.legend(loc="upper right")
    file.parent.mkdir(parents=True, exist_ok=True)
    with atomic_part(file) as part:
        figure.savefig(part, dpi=DOTS_PER_INCH, format=file.suffix[1:])
    plt.close(figure)
