"""Provenance of datasets and calibrations: code version, date, checksum."""

import hashlib
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def code_version() -> str:
    """Return ``git describe`` of the running checkout, or else the version of the installed package."""
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
    """Return the UTC date as 2023-12-31."""
    return datetime.now(UTC).date().isoformat()


def sha256(file: Path) -> str:
    """Return the hexadecimal SHA-256 digest of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()
