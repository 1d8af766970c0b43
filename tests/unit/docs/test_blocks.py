"""The code that pages show runs, in a process of its own for each page."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.unit.docs.pages import DOCS, PAGES, blocks, name

# Pages whose blocks compile for half a minute or more.
COMPILE_LONG = ("docs/how-to/differentiate_with_jax.md",)


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
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", "\n".join(blocks(page))],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
