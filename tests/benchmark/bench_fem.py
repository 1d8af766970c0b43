"""The rod beside the finite elements it stands for: time and difference at the same states.

Run as ``python -m tests.benchmark.bench_fem``: the full actuator on its coarse mesh, chamber 1 alone, each
state from the last; then the shipped rod at the same pressures, in the same process. Also writes the table of
docs/reference/benchmark.md; ``--json`` prints one object and writes nothing.
"""

import argparse
import json
import statistics
import time
from typing import Any

import numpy as np

import rodmodel
from fem_reference import Actuator, ActuatorLoad, prepare_process
from tests.benchmark.page import write_measured
from tests.benchmark.timing.figures import duration, processor

PRESSURES_KPA = (10.0, 20.0, 30.0, 40.0)
FORCE = np.array([0.0, 0.01, 0.0])
RUNS, STEPS = 2000, 4


def finite_elements() -> tuple[list[dict[str, Any]], int]:
    """States of the full actuator with the time that each took, and the number of unknowns."""
    prepare_process()
    actuator = Actuator(level="coarse")
    loads = [ActuatorLoad((1e3 * p, 0.0, 0.0), tip_force=tuple(FORCE)) for p in PRESSURES_KPA]
    rows = []
    begin = time.perf_counter()
    for state in actuator.follow(loads):
        taken, begin = time.perf_counter() - begin, time.perf_counter()
        rows.append({"fem_s": taken, "angle": state.bending_angle, "tip": state.tip_position})
    return rows, actuator.unknowns


def rod(rows: list[dict[str, Any]]) -> None:
    """Add the median time of a warm solve at each pressure, and the differences."""
    shipped = rodmodel.load_core("double-helix")
    predictor = shipped.predictor(("tip_force",), steps=STEPS, tolerance=1e-5)
    length = shipped.actuator.body_length + shipped.actuator.cap_length
    for row, kpa in zip(rows, PRESSURES_KPA, strict=True):
        pressure = np.array([1e3 * kpa, 0.0, 0.0])
        times = []
        for k in range(RUNS):
            near = pressure * (1.0 + 0.01 * np.sin(0.05 * k))
            begin = time.perf_counter()
            predictor(near, tip_force=FORCE)
            times.append(time.perf_counter() - begin)
        found = predictor(pressure, tip_force=FORCE)
        row["rod_s"] = statistics.median(times)
        row["angle_difference"] = float(found.bending_angle) - row["angle"]
        row["tip_difference"] = float(np.linalg.norm(found.tip_position - row["tip"])) / length


def table(rows: list[dict[str, Any]], unknowns: int) -> str:
    """Markdown of the rows."""
    lines = [
        "| chamber 1 | bending angle | finite elements | rod, warm | ratio | angle apart | tip apart / L |",
        "|---|---|---|---|---|---|---|",
    ]
    for kpa, row in zip(PRESSURES_KPA, rows, strict=True):
        cells = [
            f"{kpa:g} kPa",
            f"{np.degrees(row['angle']):.2f}°",
            duration(row["fem_s"]),
            duration(row["rod_s"]),
            f"{row['fem_s'] / row['rod_s']:.1e}",
            f"{np.degrees(row['angle_difference']):+.2f}°",
            f"{100.0 * row['tip_difference']:.2f} %",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", f"{unknowns} unknowns; {processor()}.", ""])


def main() -> None:
    """Measure, print, and write the page's table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one object and nothing else")
    options = parser.parse_args()
    rows, unknowns = finite_elements()
    rod(rows)
    if options.json:
        rows = [{key: np.asarray(value).tolist() for key, value in row.items()} for row in rows]
        print(json.dumps({"rows": rows, "unknowns": unknowns}))
        return
    text = table(rows, unknowns)
    print(text)
    write_measured("beside the finite elements", text)


if __name__ == "__main__":
    main()
