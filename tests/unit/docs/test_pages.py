"""Pages link to what is there, name every public name, and hold what the code itself knows."""

import math
import re
from pathlib import Path

import pytest

import fem_reference
import rodmodel
from calibration.measured import csv_file
from calibration.report.all_layouts import title
from calibration.sweep import dataset, run_schema
from fem_reference.io import actuator_record
from tests.unit.docs import reference_pages
from tests.unit.docs.pages import DOCS, NOTES, PAGES, links, name, words

REFERENCE = DOCS / "reference"
HOW_TO = sorted((DOCS / "how-to").glob("*.md"))


@pytest.mark.parametrize("page", [*PAGES, *NOTES], ids=name)
def test_every_linked_file_is_there(page: Path) -> None:
    assert [link for link in links(page) if not link.exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_figure_can_be_had_again(page: Path) -> None:
    """What was seen once, and no command prints, is for docs/notes."""
    assert "by hand" not in page.read_text().lower()


@pytest.mark.parametrize("page", HOW_TO, ids=name)
def test_a_how_to_page_is_short(page: Path) -> None:
    assert words(page) < 400


def test_every_page_is_two_links_from_the_landing_page() -> None:
    reached = {DOCS / "index.md"}
    for _ in range(2):
        reached |= {link for page in reached if page.suffix == ".md" for link in links(page)}
    assert {page for page in PAGES if page.parent.parent == DOCS} <= reached


@pytest.mark.parametrize("package", [rodmodel, fem_reference], ids=lambda p: p.__name__)
def test_the_reference_has_every_public_name(package: object) -> None:
    page = REFERENCE / f"api_{package.__name__}.md"
    told = re.findall(r"^        - (\w+)$", page.read_text(), re.MULTILINE)
    assert sorted(told) == sorted(package.__all__)


@pytest.mark.parametrize("page", reference_pages.PAGES)
def test_a_page_of_the_reference_is_that_of_the_code(page: str) -> None:
    """``python -m tests.unit.docs.reference_pages`` writes it anew."""
    assert (REFERENCE / page).read_text() == reference_pages.PAGES[page]()


def test_the_pages_of_files_name_every_key() -> None:
    """Of measurements, of sweeps and their datasets, and of the actuator's records."""
    columns = {*csv_file.PRESSURES, *csv_file.OUTPUTS, *csv_file.FORCES, *csv_file.GRAVITY}
    assert columns <= keys("measured_csv.md")
    swept = {*run_schema.STATE_KEYS, *(variable.name for variable in dataset.VARIABLES)}
    assert swept | set(actuator_record.RECORD_KEYS) <= keys("run_files.md")


def keys(page: str) -> set[str]:
    """Texts in backticks."""
    return set(re.findall(r"`([^`]+)`", (REFERENCE / page).read_text()))


def test_the_page_of_errors_is_of_the_laws_that_ship() -> None:
    """Its figures are those of the files: made anew whenever a law is."""
    maps, _ = (REFERENCE / "errors.md").read_text().split("## Rod against full actuator")
    rows = [line.split("|") for line in maps.splitlines() if line.startswith("|")]
    for calibration in rodmodel.shipped_calibrations():
        called = title(calibration.layout)
        (row,) = (row for row in rows if row[1].strip().removesuffix(" (as its file states)") == called)
        angle = calibration.error["free_bending_angle_rad"]
        stated = " / ".join(f"{math.degrees(angle[key]):.2f}" for key in ("median", "p95", "worst"))
        assert stated in [cell.strip() for cell in row], called
