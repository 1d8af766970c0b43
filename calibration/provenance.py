"""Where a dataset or a calibration comes from."""

import hashlib
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def code_version() -> str:
    """``git describe`` of the checkout that runs, else the installed package's version."""
    here = Path(__file__).resolve().parent
    command = ["git", "-C", str(here), "describe", "--always", "--dirty", "--tags", "--exclude", "*/*"]
    try:
        described = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        described = ""
    if described:
        return described
    try:
        return version("rodmodel")
    except PackageNotFoundError:
        return "unknown"


def today() -> str:
    """The date, UTC, as 2023-12-31."""
    return datetime.now(UTC).date().isoformat()


def sha256(file: Path) -> str:
    """Hex digest of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()
