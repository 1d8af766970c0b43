"""The predictor of an earlier commit, whose package is first on Python's path: its times as one JSON object.

Run by `tests.benchmark.timing.earlier` as a script with a file of the cases; it is no part of today's
package.
"""

import json
import statistics
import sys
import time

import jax
import numpy as np

import rodmodel
from rodmodel import FixedStep


def main() -> None:
    """Time cold and warm calls over the cases, as `clock.median_call` does."""
    jax.config.update("jax_enable_x64", True)
    # The next call comes when this one is done: a handover to another thread only costs.
    jax.config.update("jax_cpu_enable_async_dispatch", False)
    with np.load(sys.argv[1]) as cases:
        pressures, walk = cases["pressures"], cases["walk"]
        loads = {"tip_force": cases["tip_force"], "gravity": cases["gravity"]}
        steps, tolerance, rounds = int(cases["steps"]), float(cases["tolerance"]), int(cases["rounds"])
    predictor = rodmodel.load("double-helix").predictor(tuple(loads), solver=FixedStep(steps, tolerance))
    found = {"file": rodmodel.__file__, "cold_s": np.inf, "warm_s": np.inf}
    predictor(walk[0], **loads)
    for _ in range(rounds):
        for key, rows in (("cold_s", pressures), ("warm_s", walk)):
            times = []
            for row in rows:
                begin = time.perf_counter()
                if key == "cold_s":
                    predictor.reset()
                predictor(row, **loads)
                times.append(time.perf_counter() - begin)
            found[key] = min(found[key], statistics.median(times))
    print(json.dumps(found))


if __name__ == "__main__":
    main()
