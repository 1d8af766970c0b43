"""The code that pages show runs, in a process of its own for each page."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.unit.docs.pages import DOCS, PAGES, ROOT, blocks, indented_commands, name

# Pages whose blocks compile for half a minute or more.
COMPILE_LONG: set[str] = set()
# Pages whose blocks read what a command of the page writes: how the command begins.
COMMAND_FIRST: dict[str, list[str]] = {}
MODULES = {
    "rodmodel": "rodmodel.cli",
    "rodmodel-fem": "fem_reference.cli",
    "rodmodel-calibrate": "calibration.cli",
}


def with_blocks() -> list:
    """Pages that show code; tutorials run as notebooks, in `test_notebooks`."""
    return [
        pytest.param(page, id=name(page), marks=pytest.mark.slow if name(page) in COMPILE_LONG else ())
        for page in PAGES
        if blocks(page) and page.parent != DOCS / "tutorials"
    ]


@pytest.mark.parametrize("page", with_blocks())
def test_every_block_of_code_runs(page: Path, tmp_path: Path) -> None:
    """All blocks of a page, one after the other, as a reader would enter them."""
    if name(page) in COMMAND_FIRST:
        begin = COMMAND_FIRST[name(page)]
        command = next(words for words in indented_commands(page) if words[: len(begin)] == begin)
        rest = [str(ROOT / word) if word.startswith("docs/") else word for word in command[1:]]
        run_python(["-m", MODULES[command[0]], *rest], tmp_path)
    run_python(["-W", "error", "-c", "\n".join(blocks(page))], tmp_path)


def run_python(arguments: list[str], folder: Path) -> None:
    run = subprocess.run(
        [sys.executable, *arguments], cwd=folder, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
