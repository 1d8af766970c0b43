"""The atomic writer is one, in each of the two packages that import nothing from each other."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WRITER = "atomic.py"
# Methods and functions that write a file under the name that they are given.
WRITES = {"write_text", "write_bytes", "savefig", "savez", "savez_compressed", "savetxt", "dump"}


def test_both_packages_have_the_same_writer() -> None:
    first, second = (
        (ROOT / package / "io" / WRITER).read_text() for package in ("rodmodel", "fem_reference")
    )
    assert first == second


def bare_writes(source: str) -> list[int]:
    """Lines of a source text that write a file and are in no `with atomic_part(...)`."""
    tree = ast.parse(source)
    within = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.With) and "atomic_part" in ast.unparse(node.items[0].context_expr)
        for inner in ast.walk(node)
    }
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and (
            node.func.attr in WRITES
            or (node.func.attr == "open" and _opens_to_write(node))
            or (node.func.attr == "to_netcdf" and node.args)
        )
        and id(node) not in within
    ]


def _opens_to_write(call: ast.Call) -> bool:
    modes = [*call.args, *(keyword.value for keyword in call.keywords if keyword.arg == "mode")]
    return any(isinstance(mode, ast.Constant) and set(str(mode.value)) & set("wx") for mode in modes)


@pytest.mark.parametrize("package", ["rodmodel", "fem_reference", "calibration"])
def test_nothing_else_writes_a_file(package: str) -> None:
    found = {
        str(file.relative_to(ROOT)): lines
        for file in sorted((ROOT / package).rglob("*.py"))
        if file.name != WRITER and (lines := bare_writes(file.read_text()))
    }
    # A folder of files takes its name as a whole.
    found.pop("rodmodel/core/export/_folder.py", None)
    assert not found


@pytest.mark.parametrize(
    ("source", "number"),
    [
        ("file.write_text(text)", 1),
        ("with file.open('w') as stream:\n    stream.write(text)", 1),
        ("figure.savefig(file)", 1),
        ("dataset.to_netcdf(file)", 1),
        ("with atomic_part(file) as part:\n    figure.savefig(part)", 0),
        ("with file.open('rb') as stream:\n    stream.read()", 0),
    ],
)
def test_a_bare_write_is_found(source: str, number: int) -> None:
    assert len(bare_writes(source)) == number
