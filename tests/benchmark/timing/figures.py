"""Figures that a benchmark measures, each with its bar, and where they are kept for the page."""

import json
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
KEPT = ROOT / "build" / "bench"
PACKAGES = ("cffi", "numpy")


@dataclass(frozen=True)
class Figure:
    """What was measured, and what it is held to."""

    what: str
    value: float
    unit: str
    bar: float | None = None
    """Largest value that is good, or the least where more is better."""
    at_least: bool = False

    @property
    def met(self) -> bool | None:
        """Whether the bar is met; None where there is none."""
        if self.bar is None:
            return None
        return self.value >= self.bar if self.at_least else self.value <= self.bar

    def cells(self) -> tuple[str, str, str, str]:
        """What, measured, bar, and whether it is met, for people."""
        if self.bar is None:
            return self.what, with_unit(self.value, self.unit), "", ""
        sign = "≥" if self.at_least else "≤"
        bar = f"{sign} {self.bar:g} {self.unit}".rstrip()
        return self.what, with_unit(self.value, self.unit), bar, "met" if self.met else "**not met**"

    def line(self) -> str:
        """The same, for a terminal."""
        what, value, bar, verdict = self.cells()
        return f"{what:72s} {value:>12s}  {bar:14s} {verdict.strip('*')}".rstrip()


def with_unit(value: float, unit: str) -> str:
    """Three digits, and whole numbers whole."""
    number = f"{value:.0f}" if value >= 100 or value == int(value) else f"{value:.3g}"
    return f"{number} {unit}".rstrip()


def table(figures: Sequence[Figure]) -> str:
    """Markdown of figures."""
    lines = ["| | measured | bar | |", "|---|---|---|---|"]
    return "\n".join([*lines, *("| " + " | ".join(figure.cells()) + " |" for figure in figures), ""])


def report(name: str, figures: Sequence[Figure], as_json: bool, packages: Sequence[str] = PACKAGES) -> None:
    """Print figures and keep them."""
    record = {"figures": [asdict(figure) for figure in figures], "where": where(packages)}
    keep(name, record)
    if as_json:
        print(json.dumps(record))
        return
    for figure in figures:
        print(figure.line())
    print(record["where"])


def keep(name: str, record: dict[str, Any]) -> None:
    """Write a benchmark's record where `page` looks for it."""
    KEPT.mkdir(parents=True, exist_ok=True)
    (KEPT / f"{name}.json").write_text(json.dumps(record))


def where(packages: Sequence[str]) -> str:
    """Versions, processor, and how busy the machine was."""
    versions = ", ".join(f"{package} {version(package)}" for package in packages)
    load = os.getloadavg()[0]
    return f"Python {platform.python_version()}, {versions}; {processor()}; load average {load:.1f}."


def processor() -> str:
    """Name of the processor, as Linux tells it."""
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":")[1].strip()
    return platform.machine()


def duration(seconds: float) -> str:
    """Time with two or three digits and its unit."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size or unit == "µs":
            number = seconds / size
            return f"{number:.0f} {unit}" if number >= 100 else f"{number:.2g} {unit}"
    raise AssertionError
