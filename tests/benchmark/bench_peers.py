"""Speed against error on one rod, beside other solvers: docs/benchmark.md's table and its picture.

Run as ``python -m tests.benchmark.bench_peers``; ``--only ours scipy`` for some of the solvers, which leaves
the page and the picture as they are. The peers are in the extra `bench`.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

from tests.benchmark.page import write_measured
from tests.benchmark.speed import ONE_THREAD
from tests.benchmark.speed_picture import draw

ROOT = Path(__file__).parents[2]
PICTURE = ROOT / "docs" / "images" / "speed_against_error.png"

MODULES = ("ours", "scipy", "soromox", "elastica")
PACKAGES = ("jax", "numpy", "scipy", "numba", "soromox", "pyelastica")


def measure(module: str) -> Iterator[dict[str, Any]]:
    """Rows of one module's settings, timed in a process of its own."""
    with subprocess.Popen(
        [sys.executable, "-m", "tests.benchmark.speed", f"tests.benchmark.peer_{module}"],
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


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown of the rows, with what was measured where."""
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
    versions = ", ".join(f"{package} {version(package)}" for package in PACKAGES)
    lines += ["", f"Python {platform.python_version()}, {versions}; {processor()}, one core, one thread.", ""]
    return "\n".join(lines)


def summary(row: dict[str, Any]) -> str:
    """Error and times of a row, or why there are none."""
    if "failure" in row:
        return f"fails: {row['failure']}"
    cold, warm = duration(row["cold_s"]), duration(row["warm_s"])
    return f"error {row['error']:8.1e}   cold {cold:>8s}   warm {warm:>8s}"


def duration(seconds: float) -> str:
    """Time with two or three digits and its unit."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size or unit == "µs":
            number = seconds / size
            return f"{number:.0f} {unit}" if number >= 100 else f"{number:.2g} {unit}"
    raise AssertionError


def processor() -> str:
    """Name of the processor, as Linux tells it."""
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":")[1].strip()
    return platform.machine()


def main() -> None:
    """Measure, print, and write the page's table and the picture."""
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
    if options.json:
        print(json.dumps({"rows": rows}))
    if options.only is None:
        write_measured("measured", table(rows))
        draw([row for row in rows if "failure" not in row], PICTURE)


if __name__ == "__main__":
    main()
