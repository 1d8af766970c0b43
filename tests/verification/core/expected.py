"""What the exported example prints, as Python computes it: `main.c` says what each row is."""

import numpy as np

from rodmodel.control import LOADING
from rodmodel.core import CoreRod
from rodmodel.io import branches_of
from tests.verification.core.toolchain import found

STEPS, PATH, CYCLE = 8, 20, 28
PARTS = ((0.0, 0.0, 0.0), (0.7, 0.2, 0.0), (0.1, 0.0, 0.6))
LOADS = {"tip_force": (0.0, 2e-3, 0.0), "gravity": (0.0, 0.0, 9.81)}


def assert_example(rows: dict[str, np.ndarray], psi_deg: float, relative: float) -> None:
    """Compare rows of the example: positions to a part of the length, angles [rad] to as much."""
    rod = CoreRod.of(found(psi_deg))
    assert rows["failures"] == 0
    loads: dict[str, tuple[float, ...]]
    poses = []
    for loads in ({}, LOADS):
        poses += [_pose(rod, _pressure(rod, parts), loads, None)[0] for parts in PARTS]
    _assert_poses(rows["predict"], np.array(poses), relative)

    start = None
    for n in range(PATH + 1):
        part = n / PATH
        pose, start = _pose(rod, _pressure(rod, (0.6 * part, 0.3 * part, 0.0)), LOADS, start)
    _assert_poses(rows["path"], pose[None], relative)

    solution, jacobian = rod.jacobian(_pressure(rod, (0.5, 0.2, 0.0)), **LOADS, steps=STEPS)
    for name, columns in (("pressure", rows["jacobian"][:, :3]), ("tip_force", rows["jacobian"][:, 3:])):
        wanted = jacobian.tip_position[name]
        np.testing.assert_allclose(columns, wanted, rtol=0, atol=100 * relative * np.abs(wanted).max())

    reached = rows["inverse"][0]
    pose, _ = _pose(rod, reached[:3], LOADS, None)
    _assert_poses(rows["inverse"], pose[None], relative)
    assert np.linalg.norm(reached[3:6] - solution.tip_position) < 1e-4 + relative * _length(rod)

    assert ("psi" in rows) == (found(psi_deg).calibration.layout.psi is None)
    if "psi" in rows:
        turned = [CoreRod.of(found(psi_deg + np.degrees(0.1 * k))) for k in range(3)]
        poses = [_pose(other, _pressure(other, PARTS[1]), {}, None)[0] for other in turned]
        _assert_poses(rows["psi"], np.array(poses), relative)

    assert ("cycle" in rows) == bool(found(psi_deg).calibration.snapped)
    if "cycle" in rows:
        poses = _cycle(psi_deg)
        # It jumps up and down again.
        assert np.abs(np.diff(poses[:, 6])).max() > 0.1
        _assert_poses(rows["cycle"], poses, relative)


def _cycle(psi_deg: float) -> np.ndarray:
    """The last branch's chamber, to the end of that branch and back."""
    branches = branches_of(found(psi_deg))
    last, rod = list(branches.snapped.items())[-1]
    chamber, poses, before = last.chamber - 1, [], LOADING
    for n in range(CYCLE + 1):
        pressure = np.zeros(3)
        pressure[chamber] = rod.domain.pressure_max[chamber] * min(n, CYCLE - n) / (CYCLE // 2)
        before = branches.branch_at(pressure, before)
        poses.append(_pose(branches.rod(before), pressure, {}, None)[0])
    return np.array(poses)


def _length(rod: CoreRod) -> float:
    return float(rod.actuator.body_length + rod.actuator.cap_length)


def _pressure(rod: CoreRod, parts: tuple[float, float, float]) -> np.ndarray:
    domain = rod.domain
    alike = min(domain.pressure_sum_max / 3.0, domain.beside_max / (1.0 + 2.0 * domain.beside_share))
    return np.array(parts) * np.minimum(domain.pressure_max, alike)


def _pose(rod, pressure, loads, start):
    solution = rod.solve(pressure, **loads, steps=STEPS, start=start, throw=False)
    flat = [solution.bending_angle, solution.bending_plane, solution.in_domain]
    return np.array([*pressure, *solution.tip_position, *flat]), solution


def _assert_poses(came: np.ndarray, wanted: np.ndarray, relative: float) -> None:
    # Lengths are of 66 mm; rounding of the pressures, of their sum.
    np.testing.assert_allclose(came[:, :3], wanted[:, :3], rtol=relative)
    np.testing.assert_allclose(came[:, 3:6], wanted[:, 3:6], rtol=0, atol=0.066 * relative)
    np.testing.assert_allclose(came[:, 6], wanted[:, 6], rtol=0, atol=relative)
    # The plane of a rod whose tip points along the base's axis, to either side, but for rounding is one of
    # rounding.
    across = np.sin(wanted[:, 6])
    bent = np.abs(across) > 1e-9
    plane = across[bent] * (came[bent, 7] - wanted[bent, 7])
    np.testing.assert_allclose(plane, 0.0, rtol=0, atol=7 * relative)
    np.testing.assert_array_equal(came[:, 8], wanted[:, 8])
