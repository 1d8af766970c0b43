"""Damaged calibration files: each is refused, or makes a rod that solves without a crash or a NaN."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodmodel
from rodmodel.core import CoreRod, Result
from rodmodel.io import CalibrationFileError, find

SHIPPED = Path(rodmodel.__file__).parent / "calibrations"
NUMBERS = [0, -0.0, 1, -1, 1e-300, 5e-324, 1e9, -1e9, 1e15, 1e308, -1e308, float("nan"), float("inf"), 2**70]
OTHERS: list[Any] = [None, True, "", "x", [], {}, [[]], [1.0, [2.0]]]


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Path of every value inside a JSON object, the numbers of long arrays among them."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    found = [path] if path else []
    for key, child in inside:
        found += places(child, (*path, key))
    return found


def mutate(content: dict[str, Any], random: np.random.Generator) -> str:
    """Change one to three values: another number, another kind, another length, or nothing there."""
    for _ in range(random.integers(1, 4)):
        # A key first, so that the few scalars are hit as often as the many numbers of the arrays.
        keys = list(content)
        key = keys[random.integers(len(keys))]
        inside = places(content[key], (key,))
        by_depth = [p for p in inside if len(p) == random.integers(1, 5)] or inside
        *path, last = by_depth[random.integers(len(by_depth))]
        place: Any = content
        for step in path:
            place = place[step]
        change(place, last, random)
    return json.dumps(content)


def change(place: Any, last: Any, random: np.random.Generator) -> None:
    """Change the value at a key or index."""
    value = place[last]
    kind = random.integers(6)
    if kind == 0:
        del place[last]
    elif kind == 1:
        place[last] = OTHERS[random.integers(len(OTHERS))]
    elif kind == 2 and isinstance(value, list) and value:
        place[last] = value[: random.integers(len(value))] if random.random() < 0.5 else value + value[-1:]
    elif kind == 3 and isinstance(value, float):
        place[last] = value * 10.0 ** random.integers(-12, 13)
    elif kind == 4 and isinstance(value, float):
        place[last] = -value
    else:
        place[last] = NUMBERS[random.integers(len(NUMBERS))]


def exercise(rod: CoreRod, random: np.random.Generator, with_inverse: bool) -> None:
    """Solve, differentiate and now and then invert; what is said to be good must hold numbers."""
    for fraction in (0.0, 0.4, 1.0):
        pressure = fraction * np.array(rod.domain.pressure_max, float) * random.uniform(size=3)
        loads = {"tip_force": random.normal(scale=5e-3, size=3), "gravity": random.normal(scale=5.0, size=3)}
        for given in ({}, loads):
            solution = rod.solve(pressure, throw=False, steps=8, **given)
            assert solution.result in set(Result)
            if solution.converged:
                for name in ("tip_position", "tip_rotation", "bend", "chamber_volume", "unknown"):
                    assert np.isfinite(getattr(solution, name)).all(), name
                assert solution.load_fraction == 1.0
            rod.jacobian(pressure, steps=4, **given)
    if with_inverse:
        found = rod.inverse(bending_angle=0.3, bending_plane=1.0, throw=False)
        assert np.isfinite(found.pressure).all() or not found.reached


@pytest.mark.parametrize(
    ("name", "psi", "count"),
    [("double-helix_psi0_pitch3", 0.0, 240), ("double-helix_any-psi_pitch3", 0.3, 60)],
)
def test_damaged_files_are_refused_or_make_rods_that_solve(tmp_path: Path, name: str, psi: float, count: int):
    text = (SHIPPED / f"{name}.json").read_text()
    path = tmp_path / "calibration.json"
    refused = usable = 0
    for seed in range(count):
        random = np.random.default_rng([seed, count])
        path.write_text(mutate(json.loads(text), random))
        try:
            rod = CoreRod.of(find("double-helix", psi, 3e-3, path))
        except ValueError as error:
            refused += isinstance(error, CalibrationFileError)
            told = str(error)
            if "expected" not in told:
                pytest.fail(f"seed {seed}: {told}")
            continue
        exercise(rod, random, with_inverse=seed % 10 == 0)
        usable += 1
    # Most of what was damaged is refused as a file; what may stand there is used.
    assert refused > count // 4
    assert usable > count // 20
