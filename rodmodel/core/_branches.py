"""The core's choice among the branches of an actuator."""

from collections.abc import Sequence
from typing import Any, final

import numpy as np

from rodmodel.core._native import ffi
from rodmodel.core._rod import CoreRod


@final
class BranchChoice:
    """Branches in the core's structures, by their number: 0 is that of loading.

    Parameters
    ----------
    rods : rod of each branch.
    chambers, sides : of each branch, as in `rm_branches`.
    """

    def __init__(self, rods: Sequence[CoreRod], chambers: Sequence[int], sides: Sequence[int]) -> None:
        self._call = rods[0].handle.call
        # The structure points to these.
        self._rods = rods
        self._kept = (
            ffi.new("rm_rod *[]", [rod.handle.rod for rod in rods]),
            ffi.new("int[]", list(chambers)),
            ffi.new("int[]", list(sides)),
        )
        self._branches: Any = ffi.new("rm_branches *", (len(rods), *self._kept))

    def at(self, pressure: np.ndarray, before: int) -> int:
        """Return the branch under three pressures [Pa] after another one."""
        return int(self._call.rm_branch_at(self._branches, _pointer(pressure), before))

    def other_possible(self, pressure: np.ndarray, branch: int) -> bool:
        """Return whether a branch of the other kind goes on under these pressures."""
        return bool(self._call.rm_other_branch_possible(self._branches, _pointer(pressure), branch))


def _pointer(pressure: np.ndarray) -> Any:
    return ffi.from_buffer("rm_real *", pressure)
