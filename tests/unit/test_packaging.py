"""The installation is reproducible and complete: pins, commands and data files."""

import importlib
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PYPROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = PYPROJECT["project"]


def pins() -> dict[str, str]:
    """Return the version that constraints.txt gives each distribution."""
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    entries = [line.split("==") for line in lines if line and not line.startswith("#")]
    return {canonicalize_name(name): version for name, version in entries}


def test_constraints_hold_exact_pins_and_nothing_else() -> None:
    for line in (ROOT / "constraints.txt").read_text().splitlines():
        assert line.startswith("#") or re.fullmatch(r"[A-Za-z0-9_.-]+==[A-Za-z0-9.+]+", line), line


def test_every_requirement_is_pinned_to_a_version_it_accepts() -> None:
    groups = [PYPROJECT["build-system"]["requires"], PROJECT["dependencies"]]
    groups += PROJECT["optional-dependencies"].values()
    requirements = [Requirement(text) for group in groups for text in group]
    pinned = pins()
    for requirement in requirements:
        if requirement.name != PROJECT["name"]:
            assert requirement.specifier.contains(pinned[canonicalize_name(requirement.name)]), requirement


@pytest.mark.parametrize("command", sorted(PROJECT["scripts"]))
def test_each_command_names_a_function_that_exists(command: str) -> None:
    module, _, function = PROJECT["scripts"][command].partition(":")
    assert callable(getattr(importlib.import_module(module), function))


@pytest.mark.parametrize(
    ("package", "pattern"),
    [(p, glob) for p, globs in PYPROJECT["tool"]["setuptools"]["package-data"].items() for glob in globs],
)
def test_each_pattern_of_package_data_matches_a_file(package: str, pattern: str) -> None:
    assert list((ROOT / package).glob(pattern))


def test_changelog_has_a_section_for_this_version() -> None:
    assert re.search(
        rf"^## {re.escape(PROJECT['version'])}\b", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE
    )
