"""Pages for people, and what they show.

Conventions of a page:

* A block fenced as ``python`` runs. The blocks of a page run one after the other in one process, in an empty
  folder, with warnings as errors. Those of a tutorial run as a notebook.
* A command line stands in a block that is indented by four spaces, or fenced as ``bash``. A backslash at its
end
  continues it, and `` #`` begins a comment. A program's name may have ``.venv/bin/`` before it.
* A command inside a line of text stands in backticks. It may leave arguments out.
* docs/notes is a notebook of dated pages, which nothing holds to the code of today but their links.
"""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[3]
DOCS = ROOT / "docs"
NOTES = sorted((DOCS / "notes").glob("*.md"))
PAGES = [ROOT / "README.md", *(page for page in sorted(DOCS.rglob("*.md")) if page not in NOTES)]

_BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_INDENTED = re.compile(r"(?:^(?: {4}.*)?\n)+", re.MULTILINE)
_INLINE = re.compile(r"`([^`\n]+)`")
_SHELL = {"|", "||", "&&", ";", ">", ">>", "<", "&"}


def name(page: Path) -> str:
    """Of a page, from the root."""
    return page.relative_to(ROOT).as_posix()


def blocks(page: Path) -> list[str]:
    """Code that the page shows."""
    return _BLOCK.findall(page.read_text())


def fenced_commands(page: Path) -> Iterator[list[str]]:
    """Words of each command line that is fenced."""
    for language, text in _FENCED.findall(page.read_text()):
        if language == "bash":
            yield from _commands(text)


def indented_commands(page: Path) -> Iterator[list[str]]:
    """Words of each line of an indented block, command or not."""
    for text in _INDENTED.findall(_FENCED.sub("", page.read_text())):
        yield from _commands(text)


def inline_commands(page: Path) -> Iterator[list[str]]:
    """Words of each text in backticks, command or not."""
    for text in _INLINE.findall(_FENCED.sub("", page.read_text())):
        yield from _commands(text)


def links(page: Path) -> list[Path]:
    """Files that the page links to or shows."""
    found = re.findall(r"\]\((?!https?:)([^)#\s]+)(?:#[^)]*)?\)", _FENCED.sub("", page.read_text()))
    return [(page.parent / link).resolve() for link in found]


def words(page: Path) -> int:
    """How many there are, code included."""
    return len(page.read_text().split())


def _commands(text: str) -> Iterator[list[str]]:
    for line in text.replace("\\\n", " ").splitlines():
        try:
            found = shlex.split(re.sub(r"\s#.*", "", line))
        except ValueError:  # a quotation mark of prose
            continue
        end = next((k for k, word in enumerate(found) if word in _SHELL), len(found))
        if found[:end]:
            yield [found[0].removeprefix(".venv/bin/"), *found[1:end]]
