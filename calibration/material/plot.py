"""Plot of material tests with the fitted laws and the errors of the chosen one."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from calibration.material.choice import MaterialFit
from fem_reference.materials import MODES, nominal_stress
from rodmodel.io import atomic_part

_KPA = 1e3
_DOTS_PER_INCH = 130
_MARKERS = dict(zip(MODES, "os^", strict=True))
# Laws this far off would stretch the axis; their errors are in the table.
_DRAWN_ERROR = 0.5


def material_plot(fit: MaterialFit) -> Figure:
    """Plot nominal stress over stretch, rows and laws, and below it the errors of the chosen law."""
    figure, (stresses, errors) = plt.subplots(
        2, 1, figsize=(7.5, 7.5), sharex=True, height_ratios=(2, 1), layout="constrained"
    )
    points = fit.points
    modes = dict.fromkeys(test.mode for test in fit.tests)
    colours = {law.name: f"C{n}" for n, law in enumerate(fit.laws)}
    for mode in modes:
        of_mode = np.isin(points.test, [n for n, test in enumerate(fit.tests) if test.mode == mode])
        stretch = points.stretch[of_mode]
        lam = np.linspace(min(1.0, stretch.min()), max(1.0, stretch.max()), 200)
        for law in fit.laws:
            if law.material is None or (law.error > _DRAWN_ERROR and law is not fit.chosen):
                continue
            chosen = law is fit.chosen
            stresses.plot(
                lam,
                nominal_stress(law.material, mode, lam) / _KPA,
                colours[law.name],
                lw=2.5 if chosen else 0.9,
                ls="-" if chosen else "--",
                # One entry for each law, whatever the number of modes.
                label=(f"{law.name}, chosen" if chosen else law.name) if mode == next(iter(modes)) else None,
                zorder=3 if chosen else 1,
            )
        style = {"ls": "", "marker": _MARKERS[mode], "ms": 4, "mfc": "none", "color": "0.25"}
        stresses.plot(stretch, points.stress[of_mode] / _KPA, **style, label=f"{mode} test", zorder=2)
        error = 100.0 * points.error(fit.material)[of_mode]
        errors.plot(stretch, error, **{**style, "color": colours[fit.chosen.name]}, label=mode)
    largest = float(np.abs(points.stress).max()) / _KPA
    stresses.set_ylim(min(0.0, 1.1 * float(points.stress.min()) / _KPA), 1.15 * largest)
    stresses.set(ylabel="nominal stress [kPa]")
    stresses.legend(loc="upper left", fontsize="small")
    errors.axhline(0.0, color="0.7", lw=0.8, zorder=0)
    errors.set(xlabel="stretch", ylabel=f"{fit.chosen.name}, off by [%]")
    if len(modes) > 1:
        errors.legend(fontsize="small", ncols=len(modes))
    return figure


def write_material_plot(fit: MaterialFit, file: Path) -> None:
    """Write the plot of `material_plot`.

    Parameters
    ----------
    fit : laws fitted to tests.
    file : PNG, PDF or SVG file.
    """
    figure = material_plot(fit)
    with atomic_part(file) as part:
        figure.savefig(part, dpi=_DOTS_PER_INCH, format=file.suffix[1:].lower())
    plt.close(figure)
