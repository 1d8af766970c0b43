"""Speed against error on one rod, beside other solvers.

Run as ``python -m tests.benchmark.bench_peers``; ``--only ours scipy`` for some of the solvers, which keeps
nothing for the page. The peers are in the extra `bench`.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from rodmodel.core import ffi, lib
from tests.benchmark.timing.clock import ONE_THREAD, median_call
from tests.benchmark.timing.figures import ROOT, Figure, duration, keep, where

MODULES = ("ours", "jax", "scipy", "soromox", "elastica")
PACKAGES = ("jax", "numpy", "scipy", "numba", "soromox", "pyelastica")
OURS = "rodmodel"
#: Peers that the compiled rod is held to: how many times as fast, at the same error.
HELD_TO = {"solve_ivp + fsolve, numba": 100.0, "soromox GVS + Newton": 100.0}
#: Errors of the tip over the length at which they are compared.
ERRORS = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)


def measure(module: str) -> Iterator[dict[str, Any]]:
    """Rows of one module's settings, timed in a process of its own."""
    with subprocess.Popen(
        [sys.executable, "-m", "tests.benchmark.timing.speed", f"tests.benchmark.peers.peer_{module}"],
        cwd=ROOT,
        env=os.environ | ONE_THREAD,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        for line in process.stdout or ():
            yield json.loads(line)
    if process.returncode != 0:
        raise RuntimeError(
            f"peer_{module}: got exit status {process.returncode}, expected 0; is the extra `bench` "
            "installed (make bench does that)?"
        )


def fastest(rows: Sequence[dict[str, Any]], family: str, start: str, error: float) -> float | None:
    """Time of a family's fastest setting within an error [s]; None where it has none."""
    times = [
        row[f"{start}_s"]
        for row in rows
        if row["family"] == family and "failure" not in row and row["error"] <= error
    ]
    return min(times, default=None)


def ratios(rows: Sequence[dict[str, Any]]) -> Iterator[Figure]:
    """Figures of the peers' times over ours at the same error, and an empty call for comparison."""
    for family, bar in HELD_TO.items():
        for error in ERRORS:
            for start in ("cold", "warm"):
                theirs, ours = (fastest(rows, name, start, error) for name in (family, OURS))
                if theirs is not None and ours is not None:
                    name = f"{family} at {error:.0e}, {start}, times ours"
                    yield Figure(name, theirs / ours, "", bar, at_least=True)
    options = ffi.new("rm_options *")
    empty = median_call(lambda _: lib.rm_default_options_baseline(options))
    yield Figure("limit of any call: an empty one through cffi", 1e6 * empty, "µs")


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Markdown of the rows."""
    lines = [
        "| solver | setting | tip error / L | cold start | warm start | first call |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        if "failure" in row:
            lines.append(f"| {row['family']} | {row['label']} | fails: {row['failure']} | | | |")
            continue
        times = [duration(row[key]) for key in ("cold_s", "warm_s", "first_call_s")]
        lines.append(" | ".join(["| " + row["family"], row["label"], f"{row['error']:.0e}", *times]) + " |")
    return "\n".join([*lines, ""])


def summary(row: dict[str, Any]) -> str:
    """Error and times of a row, or why there are none."""
    if "failure" in row:
        return f"fails: {row['failure']}"
    cold, warm = duration(row["cold_s"]), duration(row["warm_s"])
    return f"error {row['error']:8.1e}   cold {cold:>8s}   warm {warm:>8s}"


def main() -> None:
    """Measure, print, and keep the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=MODULES)
    parser.add_argument("--json", action="store_true", help="print one object and nothing else")
    options = parser.parse_args()
    rows = []
    for module in options.only or MODULES:
        for row in measure(module):
            rows.append(row)
            if not options.json:
                print(f"{row['family']:28s} {row['label']:26s} {summary(row)}", flush=True)
    figures = [*ratios(rows)]
    record = {"rows": rows, "figures": [asdict(figure) for figure in figures], "where": where(PACKAGES)}
    if options.json:
        print(json.dumps(record))
    else:
        for figure in figures:
            print(figure.line())
    if options.only is None:
        keep("peers", record)


if __name__ == "__main__":
    main()
