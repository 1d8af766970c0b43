"""The command lines that pages show are ones that the programs take."""

import argparse
import re
from pathlib import Path

import pytest

from tests.unit.docs.pages import (
    PAGES,
    ROOT,
    fenced_commands,
    indented_commands,
    inline_commands,
    name,
)
from tests.unit.docs.reference_pages import PROGRAMS, commands_of, parser_of

# Files of the repository that are no output of a command.
OURS = re.compile(r"(calibration|examples|fem_reference|rodmodel|tests)/[\w./*:-]+")
# What else a page may tell a reader to type.
OTHERS = {
    "apt-get",
    "cd",
    "cmake",
    "ctest",
    "export",
    "git",
    "ls",
    "make",
    "mv",
    "pip",
    "pytest",
    "python",
    "ruff",
}


@pytest.fixture(scope="module")
def parsers() -> dict[str, argparse.ArgumentParser]:
    return {program: parser_of(main) for program, main in PROGRAMS.items()}


def test_every_program_is_shown() -> None:
    shown = {words[0] for page in PAGES for words in indented_commands(page)}
    assert set(PROGRAMS) <= shown


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_command_line_is_one_that_the_program_takes(
    page: Path, parsers: dict[str, argparse.ArgumentParser]
) -> None:
    """Taken as far as the parser: some run for hours."""
    fenced = list(fenced_commands(page))
    unknown = {words[0] for words in fenced} - set(PROGRAMS) - OTHERS
    assert not unknown
    for words in [*fenced, *indented_commands(page)]:
        if words[0] in PROGRAMS:
            parsers[words[0]].parse_args(words[1:])
        check_files(words)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_command_in_a_line_of_text_is_known(
    page: Path, parsers: dict[str, argparse.ArgumentParser]
) -> None:
    """Its subcommand and options; arguments may be left out there."""
    for words in inline_commands(page):
        if words[0] not in PROGRAMS:
            check_files(words)
        elif len(words) > 1 and not words[1].startswith("-"):
            known = {called: parser for called, _, parser in commands_of(parsers[words[0]])}
            assert words[1] in known, words
            options = {o for action in known[words[1]]._actions for o in action.option_strings}
            assert {word for word in words if word.startswith("--")} <= options, words


def check_files(words: list[str]) -> None:
    """Targets, modules and files of the repository that a command, or a text in backticks, names exist."""
    program, *rest = words
    for path in (word.partition("::")[0] for word in words if OURS.fullmatch(word)):
        assert list(ROOT.glob(path)), words
    if program == "make":
        makefile = (ROOT / "Makefile").read_text()
        for target in (word for word in rest if re.fullmatch(r"[a-z][a-z-]*", word)):
            assert re.search(rf"^{target}\b.*:", makefile, re.MULTILINE), words
    elif program == "python" and rest[:1] == ["-m"] and rest[1].startswith("tests."):
        module = ROOT / rest[1].replace(".", "/")
        assert module.with_suffix(".py").exists() or (module / "__main__.py").exists(), words
