"""Who may import whom: the rod and the FEM stand apart, and calibration sees only what both publish.

Rooms see what others of their package have at their doors, in no circle; those of the compiled rod see no
JAX, and the solver no geometry.
"""

import ast
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from graphlib import TopologicalSorter
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

    `published` holds the names in `__all__` of each package that calibration may use, and those at the doors
    of its rooms.
    """
    found = []
    for use in uses(source):
        if use.package == importer:
            continue
        taken = use.module if use.name is None else f"{use.module}.{use.name}"
        if importer != "calibration":
            found.append(f"line {use.line}: {importer} imports {taken}")
        elif use.module not in published:
            found.append(f"line {use.line}: calibration imports {taken}, neither a package nor a room of one")
        elif use.name is not None and use.name not in published[use.module]:
            found.append(f"line {use.line}: calibration imports {taken}, which is not at the door")
    return found


def published_by(package: str) -> dict[str, set[str]]:
    """Return what calibration may take from a package and from its rooms."""
    rooms = {f"{package}.{door.parent.name}": door for door in (ROOT / package).glob("*/__init__.py")}
    doors = {
        room: {
            alias.name
            for node in ast.parse(door.read_text()).body
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
            if alias.asname == alias.name
        }
        for room, door in rooms.items()
    }
    return {package: published_names(package), **doors}


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
    published = published_by("rodmodel") | published_by("fem_reference")
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


# Rooms of rodmodel that work without JAX: it may be imported in their functions, when a caller asks for it.
WITHOUT_JAX = {"actuator", "cli", "control", "core", "error_bound", "io", "view"}
WITH_JAX = {"jax", "equinox", "diffrax", "optimistix"}


# Rooms of the FEM that any equations may use: what they may import besides each other.
OF_ANY_EQUATIONS = {"algebra", "solver"}
GENERAL = {"algebra", "errors", "solver"}
# Files that a folder may hold before nobody finds one.
MOST_FILES = 14


class RoomUse(NamedTuple):
    """One import within a package, or of a package of JAX."""

    line: int
    module: str
    late: bool  # in a function, or for type checkers alone


def room_uses(source: str) -> Iterator[RoomUse]:
    """Yield what a source text imports, and whether the import waits for a call."""
    tree = ast.parse(source)
    late = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            late |= {id(inner) for inner in ast.walk(node)}
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            late |= {id(inner) for branch in node.body for inner in ast.walk(branch)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield RoomUse(node.lineno, alias.name, id(node) in late)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module is not None:
            for alias in node.names:
                yield RoomUse(node.lineno, f"{node.module}.{alias.name}", id(node) in late)


def room_violations(package: str, room: str, source: str, doors: dict[str, set[str]]) -> list[str]:
    """Return what `source`, a file of a room of a package, may not import, one sentence each.

    `doors` holds the names that each room exports. A room is a package, or a module beside the packages. In a
    function, what is public behind a door may be imported too: a door need not load all that is rarely used.
    """
    without_jax = WITHOUT_JAX if package == "rodmodel" else set()
    found = []
    for use in room_uses(source):
        top, *rest = use.module.split(".")
        if top in WITH_JAX and room in without_jax and not use.late:
            found.append(f"line {use.line}: {room} imports {top}, but not in a function")
        if top != package or not rest or rest[0] == room:
            continue
        other, *names = rest
        if other not in doors:
            found.append(f"line {use.line}: {room} imports {use.module}, which is no room")
        elif other == "cli":
            found.append(f"line {use.line}: {room} imports {use.module}, which is for people")
        elif names and names[0] not in doors[other] and not (use.late and is_public(names)):
            found.append(f"line {use.line}: {room} imports {use.module}, which is not at the door")
        elif room in without_jax and other not in without_jax and not use.late:
            found.append(f"line {use.line}: {room} imports {other}, which needs JAX, but not in a function")
        elif package == "fem_reference" and room in OF_ANY_EQUATIONS and other not in GENERAL:
            found.append(f"line {use.line}: {room} imports {other}, but knows no geometry")
    return found


def is_public(names: list[str]) -> bool:
    return not any(name.startswith("_") for name in names)


def door(file: Path) -> set[str]:
    """Return the names that a room exports: what its door imports or defines under a public name."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom | ast.Import):
            names |= {alias.asname for alias in node.names if alias.asname is not None}
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names |= {target.id for target in targets if isinstance(target, ast.Name)}
    return {name for name in names if not name.startswith("_")}


def rooms(package: str) -> dict[str, list[Path]]:
    """Return the files of each room of a package, its door first."""
    doors = (ROOT / package).glob("*/__init__.py")
    found = {file.parent.name: [file, *file.parent.rglob("*.py")] for file in doors}
    found |= {file.stem: [file] for file in (ROOT / package).glob("*.py") if file.stem != "__init__"}
    return found


ROOMS = [(package, room) for package in PACKAGES for room in sorted(rooms(package))]


@pytest.mark.parametrize(("package", "room"), ROOMS)
def test_rooms_import_each_other_by_their_doors(package: str, room: str) -> None:
    within = rooms(package)
    doors = {name: door(files[0]) for name, files in within.items() if not name.startswith("_")}
    found = {
        str(file.relative_to(ROOT)): wrong
        for file in within[room]
        if (wrong := room_violations(package, room, file.read_text(), doors))
    }
    assert not found


@pytest.mark.parametrize("package", PACKAGES)
def test_rooms_import_each_other_in_no_circle(package: str) -> None:
    before = {
        room: {
            use.module.split(".")[1]
            for file in files
            for use in room_uses(file.read_text())
            if use.module.startswith(f"{package}.") and not use.late
        }
        - {room}
        for room, files in rooms(package).items()
    }
    order = list(TopologicalSorter(before).static_order())
    assert set(order) >= set(rooms(package))


@pytest.mark.parametrize("package", PACKAGES)
def test_files_import_each_other_in_no_circle(package: str) -> None:
    names = {
        ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file
        for file in (ROOT / package).rglob("*.py")
    }
    before = {
        name: {
            imported
            for use in room_uses(file.read_text())
            if not use.late
            if (imported := use.module if use.module in names else use.module.rpartition(".")[0]) in names
            and imported != name
        }
        for name, file in names.items()
    }
    assert set(TopologicalSorter(before).static_order()) >= set(names)


@pytest.mark.parametrize("top", [*PACKAGES, "examples", "tests"])
def test_folders_stay_small_enough_to_find_a_file_in(top: str) -> None:
    folders = [
        ROOT / top,
        *(folder for folder in (ROOT / top).rglob("*/") if "__pycache__" not in folder.parts),
    ]
    counts = {
        str(folder.relative_to(ROOT)): number
        for folder in folders
        if (number := sum(file.suffix in {".py", ".c", ".h"} for file in folder.iterdir())) > MOST_FILES
    }
    assert not counts


@pytest.mark.parametrize(
    ("package", "room", "source"),
    [
        ("rodmodel", "io", "import jax"),
        ("rodmodel", "core", "from jax import numpy"),
        ("rodmodel", "view", "from rodmodel.section import SectionLaw"),
        ("rodmodel", "cli", "from rodmodel.view.rod_plot import plot_rod"),
        ("rodmodel", "cli", "def late():\n    from rodmodel.view._colours import CHAMBERS"),
        ("rodmodel", "control", "from rodmodel.core import _native"),
        ("rodmodel", "control", "from rodmodel.core import spin"),
        ("rodmodel", "statics", "from rodmodel import Rod"),
        ("rodmodel", "statics", "def late():\n    from rodmodel._rod import Rod"),
        ("rodmodel", "view", "from rodmodel.cli import main"),
        ("fem_reference", "cell", "from fem_reference.solver.newton import solve"),
        ("fem_reference", "solver", "from fem_reference.mesh import BodyMesh"),
        ("calibration", "fit", "from calibration.sweep import spin"),
    ],
)
def test_an_import_past_a_door_is_found(package: str, room: str, source: str) -> None:
    doors = {
        "rodmodel": {"core": {"CoreRod"}, "section": {"SectionLaw"}, "view": {"plot_rod"}, "cli": {"main"}},
        "fem_reference": {"solver": {"solve"}, "mesh": {"BodyMesh"}, "cell": {"PeriodCell"}},
        "calibration": {"fit": {"fit"}, "sweep": {"run_sweep"}},
    }
    assert len(room_violations(package, room, source, doors[package])) == 1


@pytest.mark.parametrize(
    ("room", "source"),
    [
        ("io", "def late():\n    import jax"),
        (
            "io",
            "if TYPE_CHECKING:\n    from rodmodel.section import SectionLaw",
        ),
        ("cli", "def late():\n    from rodmodel.core.export import export"),
        ("io", "import numpy\nfrom rodmodel.io._record import Record"),
        ("section", "import jax\nfrom rodmodel.core import CoreRod"),
    ],
)
def test_an_import_by_a_door_is_not_reported(room: str, source: str) -> None:
    assert room_violations("rodmodel", room, source, {"core": {"CoreRod"}, "section": {"SectionLaw"}}) == []


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
