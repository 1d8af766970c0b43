"""The predictor of 3f08d54, compiled by JAX, on the same machine in the same run."""

import io
import json
import os
import subprocess
import sys
import tarfile
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmark.timing.clock import ONE_THREAD
from tests.benchmark.timing.figures import KEPT, ROOT

COMMIT = "3f08d54"
_TREE = ROOT / "build" / f"bench-{COMMIT}"
_SCRIPT = Path(__file__).parents[1] / "peers" / "peer_earlier.py"


def times(**cases: Any) -> dict[str, float] | None:
    """Median cold and warm call of the quietest round [s]; None where this checkout lacks the commit.

    Parameters
    ----------
    cases : `pressures` and `walk`, (n, 3) [Pa], `tip_force` [N], `gravity` [m/s²], `steps`, `tolerance`
        [rad] and `rounds`.
    """
    if not _brought():
        return None
    file = KEPT / "earlier_cases.npz"
    KEPT.mkdir(parents=True, exist_ok=True)
    np.savez(file, **cases)
    environment = os.environ | ONE_THREAD | {"PYTHONPATH": str(_TREE)}
    command = [sys.executable, str(_SCRIPT), str(file)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    found: dict[str, Any] = json.loads(done.stdout)
    package = Path(found.pop("file"))
    if _TREE not in package.parents:
        raise RuntimeError(f"rodmodel: got {package}, expected that of {_TREE}")
    return found


def _brought() -> bool:
    """Whether the commit's package lies in the tree for it, put there if need be."""
    if (_TREE / "rodmodel").exists():
        return True
    command = ["git", "archive", COMMIT, "rodmodel"]
    archive = subprocess.run(command, cwd=ROOT, capture_output=True, check=False)
    if archive.returncode != 0:
        return False
    with tarfile.open(fileobj=io.BytesIO(archive.stdout)) as files:
        files.extractall(_TREE, filter="data")
    return True
