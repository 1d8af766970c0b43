"""What README and docs show runs, in a process of its own for each page, and what they link to is there."""

import argparse
import math
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import rodmodel
from calibration.cli import main as calibrate
from calibration.layouts_report import title
from fem_reference.cli import main as compute
from rodmodel.cli import main as predict

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!https?:)([^)#]+)(?:#[^)]*)?\)")
COMMAND = re.compile(
    r"^    (?:\.venv/bin/)?(rodmodel(?:-fem|-calibrate)?) ((?:[^\n]*\\\n)*[^\n]*)$", re.MULTILINE
)
# Pages whose blocks compile for a minute or more.
COMPILES_LONG = ("controller.md", "calibration.md")
PROGRAMS = {"rodmodel": predict, "rodmodel-fem": compute, "rodmodel-calibrate": calibrate}
# Commands of a page that write what its blocks read.
TEMPLATE = str(ROOT / "docs" / "measured_template.csv")
BEFORE = {"calibration.md": ["fit-measured", TEMPLATE, "--out", "mine.json"]}


def with_blocks() -> list:
    """Pages that show code."""
    return [
        pytest.param(page, id=page.name, marks=pytest.mark.slow if page.name in COMPILES_LONG else ())
        for page in PAGES
        if BLOCK.search(page.read_text())
    ]


@pytest.mark.parametrize("page", with_blocks())
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


def shown_commands() -> list[tuple[str, list[str]]]:
    """Program and arguments of each command line that a page shows; comments are left out."""
    found = []
    for page in PAGES:
        for program, rest in COMMAND.findall(page.read_text()):
            line = re.sub(r"\s+#.*", "", rest.replace("\\\n", " "))
            found.append((program, shlex.split(line)))
    return found


def test_every_command_line_is_one_that_the_program_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Taken as far as the parser: some run for hours."""

    class TakenError(Exception):
        pass

    parse = argparse.ArgumentParser.parse_args

    def parse_and_stop(parser: argparse.ArgumentParser, arguments: list[str]) -> None:
        parse(parser, arguments)
        raise TakenError

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", parse_and_stop)
    commands = shown_commands()
    assert {program for program, _ in commands} == set(PROGRAMS)
    for program, arguments in commands:
        with pytest.raises(TakenError):
            PROGRAMS[program](arguments)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_target_and_module_that_is_named_is_there(page: Path) -> None:
    text = page.read_text()
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"^    make ([a-z-]+)", text, re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
    for module in re.findall(r"python -m (tests\.[a-z_.]+)", text):
        assert (ROOT / module.replace(".", "/")).with_suffix(".py").exists(), module


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
