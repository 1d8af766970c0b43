"""The command line as whole processes, and the first call of each function in a fresh Python.

Run as ``python -m tests.benchmark.bench_processes``; ``--json`` for one object. Every figure is the median of
five processes, each of which starts Python, imports and answers; bytecode is there, as in an installation. A
first call comes after a rod is loaded and brings with it whatever Python has to import for it.
"""

import argparse
import statistics

from tests.benchmark.timing.clock import fresh_processes
from tests.benchmark.timing.figures import Figure, report

PROCESSES, WORKSPACE = 5, 100
COMMAND = "import sys; from rodmodel.cli import main; sys.exit(main())"
GRAVITY = ("--gravity", "0", "0", "9.81")
PRESSURE = ("predict", "--pressure-kpa", "30", "0", "0")
TARGET = ("inverse", "--bending-angle-deg", "40", "--bending-plane-deg", "20")
#: Arguments of a command, and the seconds that it may take.
COMMANDS: dict[str, tuple[tuple[str, ...], float]] = {
    "predict": (PRESSURE, 0.5),
    "predict, tip force and gravity": ((*PRESSURE, "--tip-force-n", "0", "0.01", "0", *GRAVITY), 0.5),
    "inverse": (TARGET, 0.6),
    "inverse, gravity": ((*TARGET, *GRAVITY), 0.7),
    "layouts": (("layouts",), 0.4),
}
FIRST = """
import sys, time
import rodmodel
rod = rodmodel.load_core("double-helix")
pressure, loads = (3e4, 0.0, 0.0), {{"tip_force": (0.0, 0.01, 0.0), "gravity": (0.0, 0.0, 9.81)}}
begin = time.perf_counter()
{call}
print(time.perf_counter() - begin)
"""
CALLS = {
    "solve": "rod.solve(pressure, **loads)",
    "jacobian": "rod.jacobian(pressure, **loads)",
    "inverse": "rod.inverse(0.7, 0.3)",
    "inverse, tip force and gravity": "rod.inverse(0.7, 0.3, **loads)",
    "predictor, made and called": "rod.predictor(tuple(loads))(pressure, **loads)",
    f"workspace of {WORKSPACE}": (
        "from rodmodel.control import workspace\n"
        f"workspace(rod, {WORKSPACE}, {{}}, lambda done, samples: None)"
    ),
}
FIRST_CALL = 5.0


def process(arguments: tuple[str, ...]) -> float:
    """Median time of a command as a process [s]."""
    return statistics.median(seconds for seconds, _ in fresh_processes(COMMAND, arguments, PROCESSES))


def first_call(call: str) -> float:
    """Median time of a call that is the first after loading [s]."""
    found = fresh_processes(FIRST.format(call=call), (), PROCESSES)
    return statistics.median(float(printed) for _, printed in found)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    options = parser.parse_args()
    figures = [
        Figure(f"rodmodel {name}: the whole process", process(arguments), "s", bar)
        for name, (arguments, bar) in COMMANDS.items()
    ]
    figures += [
        Figure(f"first {name}, after loading", 1e3 * first_call(call), "ms", FIRST_CALL)
        for name, call in CALLS.items()
    ]
    report("processes", figures, options.json)


if __name__ == "__main__":
    main()
