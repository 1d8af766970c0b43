"""Who may import whom: the rod and the FEM stand apart, and calibration sees only what both publish."""

import ast
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("rodmodel", "fem_reference", "calibration")


class Use(NamedTuple):
    """One import of a project package, or one attribute taken from it."""

    line: int
    module: str  # dotted, as written: "rodmodel" or "rodmodel.section"
    name: str | None  # what is taken from it; None for the module itself

    @property
    def package(self) -> str:
        return self.module.partition(".")[0]


def uses(source: str) -> Iterator[Use]:
    """Yield each absolute reference of a source text to one of the project's packages.

    Relative imports cannot leave their package and are passed over.
    """
    tree = ast.parse(source)
    bound: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                package = alias.name.partition(".")[0]
                if package in PACKAGES:
                    bound[alias.asname or package] = alias.name if alias.asname else package
                    yield Use(node.lineno, alias.name, None)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module is not None:
            if node.module.partition(".")[0] in PACKAGES:
                for alias in node.names:
                    yield Use(node.lineno, node.module, alias.name)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith(("import_module", "__import__")):
            match node.args:
                case [ast.Constant(value=str(module)), *_] if module.partition(".")[0] in PACKAGES:
                    yield Use(node.lineno, module, None)
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in bound:
            yield Use(node.lineno, bound[node.value.id], node.attr)


def violations(importer: str, source: str, published: dict[str, set[str]]) -> list[str]:
    """Return what `source`, a file of package `importer`, may not import, one sentence each.

    `published` holds the names in `__all__` of each package that calibration may use.
    """
    found = []
    for use in uses(source):
        if use.package == importer:
            continue
        taken = use.module if use.name is None else f"{use.module}.{use.name}"
        if importer != "calibration":
            found.append(f"line {use.line}: {importer} imports {taken}")
        elif use.module != use.package:
            found.append(f"line {use.line}: calibration imports {taken}, a submodule, not the public API")
        elif use.name is not None and use.name not in published[use.package]:
            found.append(f"line {use.line}: calibration imports {taken}, which is not in __all__")
    return found


def published_names(package: str) -> set[str]:
    """Return the names in the literal `__all__` of a package, without importing it."""
    for node in ast.parse((ROOT / package / "__init__.py").read_text()).body:
        match node:
            case (
                ast.Assign(targets=[ast.Name(id="__all__")], value=value)
                | ast.AnnAssign(target=ast.Name(id="__all__"), value=ast.expr() as value)
            ):
                return set(ast.literal_eval(value))
    return set()


@pytest.mark.parametrize("package", PACKAGES)
def test_packages_import_only_what_the_design_allows(package: str) -> None:
    published = {other: published_names(other) for other in ("rodmodel", "fem_reference")}
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    found = {
        str(file.relative_to(ROOT)): wrong
        for file in files
        if (wrong := violations(package, file.read_text(), published))
    }
    assert not found


@pytest.mark.parametrize(
    ("importer", "source"),
    [
        ("rodmodel", "import fem_reference"),
        ("rodmodel", "def late():\n    from calibration import fit"),
        ("rodmodel", "import importlib\nimportlib.import_module('fem_reference.cell')"),
        ("fem_reference", "import rodmodel as r"),
        ("fem_reference", "from rodmodel.section import law"),
        ("calibration", "from fem_reference.cell import PeriodCell"),
        ("calibration", "import fem_reference.cell"),
        ("calibration", "from fem_reference import _kernels"),
        ("calibration", "from fem_reference import mesh"),
        ("calibration", "import rodmodel as r\nr._section"),
    ],
)
def test_a_forbidden_import_is_found(importer: str, source: str) -> None:
    assert len(violations(importer, source, {"rodmodel": {"load"}, "fem_reference": {"PeriodCell"}})) >= 1


@pytest.mark.parametrize(
    ("importer", "source"),
    [
        ("rodmodel", "import jax\nfrom rodmodel.section import law\nfrom . import load"),
        ("calibration", "import rodmodel as r\nr.load('none').section.moment"),
        ("calibration", "from fem_reference import PeriodCell\nfrom calibration.dataset import read"),
    ],
)
def test_an_allowed_import_is_not_reported(importer: str, source: str) -> None:
    assert violations(importer, source, {"rodmodel": {"load"}, "fem_reference": {"PeriodCell"}}) == []


def test_importing_rodmodel_loads_no_heavy_package_and_leaves_jax_single_precision() -> None:
    script = (
        "import json, sys, rodmodel, jax; "
        "print(json.dumps([sorted({m.partition('.')[0] for m in sys.modules}), jax.config.jax_enable_x64]))"
    )
    environment = {name: value for name, value in os.environ.items() if name != "JAX_ENABLE_X64"}
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    loaded, double_precision = json.loads(run.stdout)
    # A base install lacks the FEM's packages; the others it has, and a cold start does not pay for them.
    heavy = {"gmsh", "skfem", "ipctk", "pypardiso", "scipy", "matplotlib", "pandas", "xarray"}
    assert heavy.isdisjoint(loaded)
    assert {"fem_reference", "calibration"}.isdisjoint(loaded)
    assert not double_precision
