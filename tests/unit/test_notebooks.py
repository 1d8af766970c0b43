"""Each tutorial is a notebook: it runs from its first cell to its last and prints what its page shows.

A page is jupytext's Markdown: ``python`` and ``bash`` blocks are cells. A ``text`` block right after a cell
shows lines that it prints, in their order; lines may be left out.
"""

import os
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import nbformat
import pytest

ROOT = Path(__file__).parents[2]
TUTORIALS = ROOT / "docs" / "tutorials"
# What a lesson reads of the checkout in whose folder it is opened.
READ = (
    "calibration/datasets",
    "calibration/truth/full_actuator.nc",
    "designs",
    "docs/measured_template.csv",
    "examples",
    "rodmodel/calibrations",
)
SLOW = ("own_actuator", "paper")
SHOWN = re.compile(r"\A```text\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"[-+−]?\d+(?:\.(\d+))?")


def lessons() -> list:
    """Pages of tutorials but the list of them."""
    names = sorted(page.stem for page in TUTORIALS.glob("*.md") if page.stem != "index")
    return [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in names]


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """Folder that reads like a checkout, and to which a lesson may write."""
    for name in READ:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).symlink_to(ROOT / name)
    return tmp_path


@pytest.mark.parametrize("lesson", lessons())
def test_a_lesson_runs_as_a_notebook_and_prints_what_its_page_shows(lesson: str, checkout: Path) -> None:
    file, programs = checkout / "executed.ipynb", Path(sys.executable).parent
    run = subprocess.run(
        [sys.executable, ROOT / "tests/unit/execute_notebook.py", TUTORIALS / f"{lesson}.md", file],
        cwd=checkout,
        env={**os.environ, "PATH": os.pathsep.join([str(programs), os.environ["PATH"]])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    cells = nbformat.read(file, as_version=4).cells
    compared = 0
    for cell, after in pairwise(cells):
        shown = SHOWN.match(after.source) if cell.cell_type == "code" else None
        if shown:
            lines = printed(cell)
            missing = lines_missing(shown[1].splitlines(), lines)
            assert not missing, "\n".join([cell.source, "printed", *lines])
            compared += 1
    assert compared > 0


def printed(cell: nbformat.NotebookNode) -> list[str]:
    """Lines on the standard output of a cell."""
    streams = [output for output in cell.outputs if output.output_type == "stream"]
    return "".join(stream.text for stream in streams if stream.name == "stdout").splitlines()


def lines_missing(shown: list[str], lines: list[str]) -> list[str]:
    """Shown lines that are not among the printed ones, in the same order."""
    rest = iter(lines)
    return [line for line in shown if not any(alike(line, other) for other in rest)]


def alike(shown: str, line: str) -> bool:
    """Whether two lines say the same, and their numbers are the same to one of the last digit shown."""
    if words(shown) != words(line):
        return False
    pairs = zip(NUMBER.finditer(shown), NUMBER.finditer(line), strict=True)
    return all(abs(value(one) - value(other)) < 1.01 * 10.0 ** -len(one[1] or "") for one, other in pairs)


def words(line: str) -> str:
    """What is left without numbers and spaces."""
    return re.sub(r"\s", "", NUMBER.sub("#", line))


def value(number: re.Match) -> float:
    """Number, also with a true minus sign."""
    return float(number[0].replace("−", "-"))


@pytest.mark.parametrize(
    "shown",
    [
        ["tip [mm]: [-18.9  0.1 62.1]"],
        ["tip [m]: [-18.6  0.1 62.1]"],
        ["tip [mm]: [-18.6  0.1 62.1]", "θ 29.4°, γ 1.0°"],
    ],
    ids=["number", "word", "order"],
)
def test_a_line_is_missing_where_it_differs(shown: list[str]) -> None:
    lines = ["θ 29.4°, γ 1.0°", "tip [mm]: [-18.6  0.1 62.1]"]
    assert not lines_missing(["tip [mm]: [-18.7 0.1 62.1]"], lines)
    assert lines_missing(shown, lines)
