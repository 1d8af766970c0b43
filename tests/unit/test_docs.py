"""What README and docs show runs, in a process of its own for each page, and what they link to is there."""

import math
import re
import subprocess
import sys
from pathlib import Path

import pytest

import rodmodel
from calibration.layouts_report import title

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!https?:)([^)#]+)(?:#[^)]*)?\)")
# Commands of a page that write what its blocks read.
TEMPLATE = str(ROOT / "docs" / "measured_template.csv")
BEFORE = {"calibration.md": ["fit-measured", TEMPLATE, "--out", "mine.json"]}


@pytest.mark.parametrize("page", [p for p in PAGES if BLOCK.search(p.read_text())], ids=lambda p: p.name)
def test_every_block_of_code_runs(page: Path, tmp_path: Path) -> None:
    """All blocks of a page, one after the other, as a reader would enter them."""
    if page.name in BEFORE:
        command = [sys.executable, "-m", "calibration.cli", *BEFORE[page.name]]
        subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    blocks = BLOCK.findall(page.read_text())
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", "\n".join(blocks)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_linked_file_is_there(page: Path) -> None:
    missing = [link for link in LINK.findall(page.read_text()) if not (page.parent / link).exists()]
    assert not missing


def test_the_page_of_errors_is_of_the_laws_that_ship() -> None:
    """Its figures are those of the files: made anew whenever a law is."""
    maps, _ = (ROOT / "docs" / "errors.md").read_text().split("## Rod against full actuator")
    rows = [line.split("|") for line in maps.splitlines() if line.startswith("|")]
    for calibration in rodmodel.shipped_calibrations():
        name = title(calibration.layout)
        (row,) = (row for row in rows if row[1].strip().removesuffix(" (as its file states)") == name)
        angle = calibration.error["free_bending_angle_rad"]
        stated = " / ".join(f"{math.degrees(angle[key]):.2f}" for key in ("median", "p95", "worst"))
        assert stated in [cell.strip() for cell in row], name
