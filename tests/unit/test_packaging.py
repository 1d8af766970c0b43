"""The installation is reproducible and complete: pins, commands, the extension and data files."""

import importlib
import os
import re
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PYPROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = PYPROJECT["project"]
PACKAGES: list[str] = PYPROJECT["tool"]["scikit-build"]["wheel"]["packages"]


def pins() -> dict[str, str]:
    """Return the version that constraints.txt gives each distribution."""
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    entries = [line.split("==") for line in lines if line and not line.startswith("#")]
    return {canonicalize_name(name): version for name, version in entries}


def shipped() -> set[str]:
    """Return the files that an installation must hold, from the repository: all but sweeps and the build."""
    files = {path for package in PACKAGES for path in (ROOT / package).rglob("*") if path.is_file()}
    names = {path.relative_to(ROOT).as_posix() for path in files if path.suffix not in {".pyc", ".so"}}
    names -= {"rodmodel/core/_build.py", "rodmodel/core/CMakeLists.txt"}
    return {name for name in names if not name.startswith("calibration/datasets/")}


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


def test_what_set_up_installs_by_name_is_pinned() -> None:
    commands = re.findall(
        r"pip install -c constraints\.txt ([a-z][^\n\"]*)$", (ROOT / ".ci/setup").read_text(), re.M
    )
    names = [canonicalize_name(name) for command in commands for name in command.split()]
    assert {"scikit-build-core", "ziglang"} <= set(names) <= set(pins())


@pytest.mark.parametrize("command", sorted(PROJECT["scripts"]))
def test_each_command_names_a_function_that_exists(command: str) -> None:
    module, _, function = PROJECT["scripts"][command].partition(":")
    assert callable(getattr(importlib.import_module(module), function))


def test_changelog_has_a_section_for_this_version() -> None:
    assert re.search(
        rf"^## {re.escape(PROJECT['version'])}\b", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE
    )


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Wheel of this tree; what `make setup` has compiled is not compiled again."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--no-deps",
        "--no-build-isolation",
        "--wheel-dir",
        folder,
        ROOT,
    ]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fresh environment that holds the wheel, and sees the packages it depends on but not this tree."""
    environment = tmp_path_factory.mktemp("installed")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    python = environment / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", python]
    subprocess.run([*pip, "install", "--quiet", "--no-deps", "--no-index", wheel], check=True)
    # Python reads no .pth files in a folder that a .pth file names, so not the one that leads to the tree.
    packages = environment.joinpath(*Path(sysconfig.get_path("purelib")).relative_to(sys.prefix).parts)
    (packages / "others.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return environment


def run(environment: Path, *command: str) -> str:
    """Return what a command of an environment prints, run outside this tree."""
    path = environment / "bin"
    variables = {**os.environ, "PATH": f"{path}{os.pathsep}{os.environ['PATH']}"}
    variables.pop("PYTHONPATH", None)
    done = subprocess.run(
        [path / command[0], *command[1:]], cwd=environment, env=variables, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_wheel_holds_every_module_and_data_file_and_no_sweep(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {name for name in names if name.endswith("/_native" + sysconfig.get_config_var("EXT_SUFFIX"))}
    assert any(name.startswith("rodmodel/core/src/") for name in names)
    assert shipped() <= names
    assert {name for name in names if name.endswith(".nc")} == {"calibration/truth/full_actuator.nc"}


def test_source_distribution_holds_what_the_wheel_is_made_of(tmp_path: Path) -> None:
    make = f"import scikit_build_core.build as b; b.build_sdist({str(tmp_path)!r})"
    subprocess.run([sys.executable, "-c", make], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as files:
        names = {name.partition("/")[2] for name in files.getnames()}
    assert shipped() | {"pyproject.toml", "rodmodel/core/CMakeLists.txt", "rodmodel/core/_build.py"} <= names
    assert {name for name in names if name.endswith(".nc")} == {"calibration/truth/full_actuator.nc"}


def test_installed_package_loads_its_extension_and_no_jax(installed: Path) -> None:
    code = "import sys, rodmodel, rodmodel.core._native as n; print(n.__file__, 'jax' in sys.modules)"
    file, jax = run(installed, "python", "-c", code).split()
    assert Path(file).is_relative_to(installed)
    assert jax == "False"


def test_installed_command_finds_the_calibrations(installed: Path) -> None:
    assert "double-helix" in run(installed, "rodmodel", "layouts")


@pytest.mark.parametrize("source", ["CMakeLists.txt", "_build.py", "src/rodmodel_core.c", "src/dispatch.h"])
def test_set_up_compiles_the_core_again_when_a_source_changes(source: str) -> None:
    make = [
        "make",
        "--dry-run",
        "--old-file",
        ".venv/.installed",
        "--what-if",
        f"rodmodel/core/{source}",
        "setup",
    ]
    printed = subprocess.run(make, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    assert ".ci/setup core" in printed


@pytest.mark.parametrize("program", PROJECT["scripts"])
def test_every_program_tells_its_version(program: str, capsys: pytest.CaptureFixture[str]) -> None:
    module, function = PROJECT["scripts"][program].split(":")
    with pytest.raises(SystemExit) as ended:
        getattr(importlib.import_module(module), function)(["--version"])
    assert not ended.value.code
    assert capsys.readouterr().out == f"{program} {PROJECT['version']}\n"
