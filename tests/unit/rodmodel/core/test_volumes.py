"""Asking for the chambers' volumes changes nothing else that the core finds."""

import numpy as np
import pytest

import rodmodel
from rodmodel.core import INPUT, JACOBIAN, SOLUTION, CoreRod, ffi, lib
from rodmodel.core._structs import NODE

STEPS = 6


def solved(rod: CoreRod, ask: int, given: int) -> tuple[np.void, np.ndarray, np.ndarray, np.ndarray]:
    """Solution, nodes, Jacobian and the derivatives half way, of one input."""
    row, solution = np.zeros(1, INPUT), np.zeros(1, SOLUTION)
    nodes, jacobian = np.zeros(STEPS + 1, NODE), np.zeros(1, JACOBIAN)
    along = np.zeros((2, 1, 3, 12))
    row["pressure"], row["tip_force"], row["follower_force"] = (
        (20e3, 5e3, 0.0),
        (0.0, 2e-3, 1e-3),
        (1e-3, 0, 0),
    )
    row["given"] = given
    options = rod.options(STEPS)
    options.ask = ask
    rod.handle.call.rm_solve_with_jacobian(
        rod.handle.rod,
        ffi.from_buffer("rm_input *", row),
        options,
        ffi.NULL,
        rod.handle.workspace(STEPS, with_jacobian=True),
        ffi.from_buffer("rm_node *", nodes),
        ffi.from_buffer("rm_solution *", solution),
        ffi.from_buffer("rm_jacobian *", jacobian),
        1,
        ffi.from_buffer("rm_real *", np.array([0.03])),
        ffi.from_buffer("rm_real *", along[0]),
        ffi.from_buffer("rm_real *", along[1]),
    )
    return solution[0], nodes, jacobian, along


@pytest.mark.parametrize("given", [0, lib.RM_LOADS, lib.RM_LOADS | lib.RM_FOLLOWER_FORCE])
def test_volumes_disturb_neither_pose_nor_shape_nor_derivatives(given: int):
    rod = rodmodel.load_core("double-helix")
    # Of a rod whose ends keep their volume the law is looked at without pressures, too.
    assert rod.actuator.held_length > 0.0
    with_volumes, nodes, jacobian, along = solved(rod, lib.RM_VOLUMES, given)
    without, bare_nodes, bare_jacobian, bare_along = solved(rod, 0, given)
    assert without["result"] == lib.RM_SUCCESSFUL
    assert np.all(with_volumes["chamber_volume"] > 0.0)
    for name in without.dtype.names:
        if name != "chamber_volume":
            np.testing.assert_array_equal(with_volumes[name], without[name], err_msg=name)
    assert nodes.tobytes() == bare_nodes.tobytes()
    np.testing.assert_array_equal(along, bare_along)
    for name in bare_jacobian.dtype.names:
        np.testing.assert_array_equal(jacobian[name], bare_jacobian[name], err_msg=name)
