"""Threads do not disturb each other: in C under the thread sanitizer, and in Python."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import numpy as np
import pytest

from rodmodel.control import Predictor
from rodmodel.core import CoreRod
from tests.verification.core.toolchain import C99, CORE, HERE, OWN, build, compiler, exported, found, output

GRAVITY = (0.0, 0.0, 9.81)


# The sanitizer's program compares the threads' numbers as well.
@pytest.mark.parametrize(
    "flags", [pytest.param(("-O2",), marks=pytest.mark.slow), ("-O1", "-g", "-fsanitize=thread")]
)
def test_two_threads_in_c_find_what_one_finds(tmp_path: Path, flags: tuple[str, ...]):
    folder = exported(tmp_path / "rod")
    sources = (HERE / "threads.c", *CORE)
    program = build(folder, compiler("gcc"), *C99, *flags, "-pthread", sources=sources, out="threads")
    assert output(program) == "good 200\ndiffer 0\n"


def test_two_threads_in_python_find_on_one_rod_what_one_finds():
    rod = CoreRod.of(found(OWN))
    pressures = np.random.default_rng(5).uniform(0.0, 30e3, (150, 3))

    def work(barrier: Barrier) -> list[np.ndarray]:
        barrier.wait()
        tips = []
        for pressure in pressures:
            solution, jacobian = rod.jacobian(pressure, gravity=GRAVITY, steps=8)
            tips += [solution.tip_position, solution.chamber_volume, solution.frames([0.03])]
            tips.append(jacobian.tip_position["pressure"])
        return tips

    alone = work(Barrier(1))
    barrier = Barrier(2)
    with ThreadPoolExecutor(2) as pool:
        for task in [pool.submit(work, barrier) for _ in range(2)]:
            for came, wanted in zip(task.result(), alone, strict=True):
                np.testing.assert_array_equal(came, wanted)


def test_two_threads_on_one_predictor_find_the_equilibria_of_one():
    """A call starts from whichever solution came last, so they agree to the tolerance of Newton's method."""
    rod = CoreRod.of(found(OWN))
    pressures = np.linspace([0.0, 0.0, 0.0], [30e3, 15e3, 0.0], 200)
    predictor = Predictor(rod, ("gravity",), tolerance=1e-9)
    alone = [predictor(pressure, gravity=GRAVITY).tip_position for pressure in pressures]

    def work(order: np.ndarray, barrier: Barrier) -> list[np.ndarray]:
        barrier.wait()
        return [predictor(pressures[k], gravity=GRAVITY).tip_position for k in order]

    orders = [np.arange(200), np.arange(200)[::-1]]
    barrier = Barrier(2)
    with ThreadPoolExecutor(2) as pool:
        tasks = [pool.submit(work, order, barrier) for order in orders]
        for order, task in zip(orders, tasks, strict=True):
            np.testing.assert_allclose(task.result(), np.array(alone)[order], rtol=0, atol=1e-10)
