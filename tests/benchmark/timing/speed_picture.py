"""Log-log picture of error against time per solve."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

# Colours that differ for most eyes.
_STYLES = {
    "rodmodel": ("#d55e00", "D"),
    "rodmodel in JAX, adaptive": ("#0072b2", "o"),
    "solve_ivp + fsolve, NumPy": ("#999999", "^"),
    "solve_ivp + fsolve, floats": ("#666666", "v"),
    "solve_ivp + fsolve, numba": ("#333333", "<"),
    "solve_bvp": ("#009e73", "s"),
    "soromox GVS + Newton": ("#cc79a7", "P"),
    "PyElastica, damped": ("#e69f00", "X"),
}


def draw(rows: list[dict[str, Any]], file: Path) -> None:
    """Draw cold starts open, warm starts full; a line joins the settings that none of the solver beats."""
    figure = Figure(figsize=(9.0, 6.6), layout="constrained")
    axes = figure.add_subplot()
    for family in dict.fromkeys(row["family"] for row in rows):
        colour, marker = _STYLES[family]
        of_family = [row for row in rows if row["family"] == family]
        for key, face, line, label in (("cold_s", "white", ":", None), ("warm_s", colour, "-", family)):
            points = sorted((1e3 * row[key], row["error"]) for row in of_family)
            best = [points[0]]
            for point in points[1:]:
                if point[1] < best[-1][1]:
                    best.append(point)
            axes.loglog(*zip(*best, strict=True), color=colour, linestyle=line, linewidth=0.8)
            axes.loglog(
                *zip(*points, strict=True),
                color=colour,
                marker=marker,
                markerfacecolor=face,
                markersize=6,
                linestyle="",
                label=label,
            )
    axes.axhline(1e-4, color="black", linewidth=0.6, linestyle="--")
    axes.set(
        xlabel="time per solve [ms], median on one core: open from a cold, full from a warm start",
        ylabel="error of the tip's position / L",
    )
    axes.grid(alpha=0.3, which="major")
    # Above the axes, as solvers lie all over them.
    figure.legend(loc="outside upper center", ncols=4, frameon=False, fontsize=9)
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=150)
