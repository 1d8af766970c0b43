"""Commands run in this process on a synthetic calibration."""

from pathlib import Path
from typing import Any

import pytest

import rodmodel
from rodmodel.cli import main
from tests.unit.rodmodel import calibrations


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("calibration") / "calibration.json"
    rodmodel.save_calibration(calibrations.calibration(), path)
    return path


@pytest.fixture(scope="module")
def rod(file: Path) -> rodmodel.CoreRod:
    return rodmodel.load_core("double-helix", path=file)


@pytest.fixture
def predict(file: Path, capsys: pytest.CaptureFixture[str]) -> Any:
    """Run `rodmodel predict` on the synthetic calibration: status, standard output, standard error."""

    def run(*arguments: str) -> tuple[int, str, str]:
        status = main(["predict", "--calibration", str(file), *arguments])
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return run


@pytest.fixture
def command(file: Path, capsys: pytest.CaptureFixture[str]) -> Any:
    """Run any command on the synthetic calibration: status, standard output, standard error."""

    def run(name: str, *arguments: str) -> tuple[int, str, str]:
        status = main([name, "--calibration", str(file), *arguments])
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return run
