"""The package's names come when they are asked for, and with them only what they need."""

import subprocess
import sys

import pytest

import rodmodel

HEAVY = {"jax", "equinox", "diffrax", "matplotlib", "rich", "scipy"}


def loaded_after(code: str) -> set[str]:
    """Packages that a process of its own has loaded after some code."""
    script = f"{code}\nimport sys\nprint(*sorted({{name.partition('.')[0] for name in sys.modules}}))"
    run = subprocess.run([sys.executable, "-W", "error", "-c", script], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return set(run.stdout.splitlines()[-1].split())


@pytest.mark.parametrize(
    "code",
    [
        "import rodmodel",
        "import rodmodel; dir(rodmodel); rodmodel.shipped_calibrations()",
        "import rodmodel; rodmodel.load_core('double-helix').solve([30e3, 0.0, 0.0], tip_force=[0, 0.01, 0])",
        "from rodmodel.cli import main; main(['layouts'])",
        "import rodmodel.io, rodmodel.view, rodmodel.control, rodmodel.core, rodmodel.actuator",
    ],
)
def test_the_compiled_side_loads_nothing_heavy(code: str) -> None:
    assert HEAVY.isdisjoint(loaded_after(code))


def test_the_differentiable_rod_loads_jax() -> None:
    assert "jax" in loaded_after("import rodmodel; rodmodel.load('double-helix')")


def test_every_name_is_there_and_listed() -> None:
    for name in rodmodel.__all__:
        assert getattr(rodmodel, name).__name__ == name
    assert set(rodmodel.__all__) <= set(dir(rodmodel))


@pytest.mark.parametrize("name", ["QuarticLaw", "FreeStateExpansion"])
def test_laws_that_left_say_so(name: str) -> None:
    with pytest.raises(AttributeError, match=f"rodmodel.{name} left in this release"):
        getattr(rodmodel, name)


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="module 'rodmodel' has no attribute 'lod'"):
        rodmodel.lod  # noqa: B018


@pytest.mark.parametrize(("module", "name"), [("calibration_file", "read_calibration"), ("plot", "plot_rod")])
def test_former_modules_warn_and_serve(module: str, name: str) -> None:
    script = (
        f"import warnings\nwith warnings.catch_warnings(record=True) as told:\n"
        f"    warnings.simplefilter('always')\n    from rodmodel.{module} import {name}\n"
        "assert callable(" + name + ")\nprint(*(w.category.__name__ for w in told))"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["DeprecationWarning"]
