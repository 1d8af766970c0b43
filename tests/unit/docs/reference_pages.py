"""Pages of the reference that the code itself knows: doors of packages, command line, result codes.

``python -m tests.unit.docs.reference_pages`` writes them into docs/reference/. They are committed and not
made while the site is built, so that they can be read where the code is hosted, and so that a change of an
option shows in a review. `test_pages` compares them with the code.
"""

import argparse
import ast
import importlib
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from unittest import mock

import rodmodel
from calibration.cli import main as calibrate
from calibration.cli.design import main as design
from fem_reference.cli import main as compute
from rodmodel.cli import main as predict
from rodmodel.core import Result
from tests.unit.docs.design_page import design_file

ROOT = Path(__file__).parents[3]
REFERENCE = ROOT / "docs" / "reference"
HEADER = ROOT / "rodmodel" / "core" / "src" / "rodmodel_core.h"
PROGRAMS: dict[str, Callable[[Sequence[str] | None], int]] = {
    "rodmodel": predict,
    "rodmodel-fem": compute,
    "rodmodel-calibrate": calibrate,
    "rodmodel-design": design,
}
_WRITTEN = "<!-- Written by `python -m tests.unit.docs.reference_pages`. -->"
_STATUSES = """\
A program ends with one of these statuses.

| status | meaning |
|---|---|
| 0 | The result is good. |
| 2 | The input is bad. One line on standard error names the argument, what came and what is expected. |
| 3 | A solver did not converge, or a fit is in doubt. What was reached is printed, with the reason. |
| 130 | Ctrl-C ended the program. Runs on disk are kept and can be resumed. |
| 141 | Nobody read the output to its end, as with `head`. `rodmodel` alone. |
"""


# What the page of a package's rooms begins with.
_ROOMS = {
    "rodmodel": "Names that [`rodmodel`](api_rodmodel.md) has itself are left out.",
    "fem_reference": "Names that [`fem_reference`](api_fem_reference.md) has itself are left out. They "
    "serve equations of your own, and may change from release to release.",
    "calibration": "Its [command line](command_line.md#rodmodel-calibrate) does the same for files.",
}


def parser_of(program: Callable[[Sequence[str] | None], int]) -> argparse.ArgumentParser:
    """The parser that a program builds."""

    class BuiltError(Exception):
        pass

    built: list[argparse.ArgumentParser] = []

    def keep(parser: argparse.ArgumentParser, arguments: Sequence[str] | None = None) -> None:
        built.append(parser)
        raise BuiltError

    with mock.patch.object(argparse.ArgumentParser, "parse_args", keep):
        try:
            program([])
        except BuiltError:
            return built[0]
    raise AssertionError("the program parses no arguments")


def commands_of(parser: argparse.ArgumentParser) -> Iterator[tuple[str, str, argparse.ArgumentParser]]:
    """Name, help and parser of each of a program's commands."""
    (commands,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    told = {action.dest: action.help or "" for action in commands._choices_actions}
    for name, command in commands.choices.items():
        yield name, told[name], command


def command_line() -> str:
    """Every command and option."""
    lines = ["# Command line", "", _WRITTEN, "", _STATUSES]
    lines += ["`--help` prints the same. Numbers are in the units that the options name.", ""]
    for program, main in PROGRAMS.items():
        parser = parser_of(main)
        lines += [f"## {program}", "", parser.description or "", ""]
        for name, told, command in commands_of(parser):
            lines += [f"### {program} {name}", "", f"{told[:1].upper()}{told[1:]}.", ""]
            lines += ["| argument | meaning |", "|---|---|"]
            lines += [_row(action) for action in command._actions if action.dest != "help"]
            lines.append("")
    return "\n".join(lines)


def _row(action: argparse.Action) -> str:
    """An argument, and what it means."""
    choices = "{" + ",".join(map(str, action.choices)) + "}" if action.choices else None
    value = action.metavar or choices or (action.dest.upper() if action.option_strings else action.dest)
    shown = {None: value, "+": f"{value} ...", "*": f"[{value} ...]", "?": f"[{value}]", 0: ""}
    # A tuple has a name for each value.
    shown |= {n: " ".join(value if isinstance(value, tuple) else [str(value)] * n) for n in (1, 2, 3, 4)}
    name = " ".join((*action.option_strings[:1], shown[action.nargs])).strip()
    told = (action.help or "") % vars(action)
    if action.required and action.option_strings:
        told += " (required)"
    elif action.default not in (None, False, [], "") and "default" not in told:
        told += f" (default: {_plain(action.default)})"
    return f"| `{name}` | {told} |"


def _plain(value: object) -> str:
    return " ".join(f"{number:g}" for number in value) if isinstance(value, list | tuple) else f"{value}"


def rooms(package: str) -> str:
    """Names at the doors of a package's rooms, but for those that the package has itself."""
    lines = [f"# API: the rooms of {package}", "", _WRITTEN, "", _ROOMS[package], ""]
    own = getattr(importlib.import_module(package), "__all__", ())
    for door in sorted(ROOT.glob(f"{package}/*/__init__.py")):
        names = [name for name in exported(door) if name not in own]
        if not names:
            continue
        room = f"{package}.{door.parent.name}"
        lines += [f"## {room}", "", f"::: {room}", "    options:", "      show_root_heading: false"]
        lines += ["      members:", *(f"        - {name}" for name in names), ""]
    return "\n".join(lines)


def exported(door: Path) -> list[str]:
    """Names that a package's `__init__` imports as themselves, to hand them on."""
    imports = (node for node in ast.walk(ast.parse(door.read_text())) if isinstance(node, ast.ImportFrom))
    return [alias.asname for node in imports for alias in node.names if alias.asname == alias.name]


def result_codes() -> str:
    """How a solve may end: number, names and messages."""
    enum = HEADER.read_text().partition("enum rm_result {")[2].partition("};")[0]
    noted = {
        name.lower(): " ".join(note.replace("*", " ").split())
        for name, note in re.findall(r"RM_(\w+) = \d+,?\s*/\*(.*?)\*/", enum, re.DOTALL)
    }
    lines = [
        "# Result codes",
        "",
        _WRITTEN,
        "",
        "`solution.result` says how a solve ended. `rod.solve` raises an error with the message where it did",
        "not end well, unless it is called with `throw=False`; a predictor never raises. The names are the",
        "same in C, in the compiled rod and in the differentiable one.",
        "",
    ]
    for result in Result:
        name: str = result.name
        lines += [
            f"## {name}",
            "",
            f"* C: `RM_{name.upper()}` = {int(result)}. {_sentence(noted[name])}",
            f"* `CoreRod`: `Result.{name}`. {_sentence(result.message)}",
            f"* `Rod`: `RESULTS.{name}`. {_sentence(rodmodel.RESULTS[getattr(rodmodel.RESULTS, name)])}",
            "",
        ]
    return "\n".join(lines)


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


#: By file name, what each page holds.
PAGES: dict[str, Callable[[], str]] = {
    **{f"api_rooms_{package}.md": partial(rooms, package) for package in _ROOMS},
    "command_line.md": command_line,
    "design_file.md": design_file,
    "result_codes.md": result_codes,
}

if __name__ == "__main__":
    for page, text in PAGES.items():
        (REFERENCE / page).write_text(text())
