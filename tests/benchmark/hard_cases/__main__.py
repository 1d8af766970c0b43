"""Hard cases of the finite elements: iterations, seconds and outcome of each, beside the recorded ones.

Run as ``python -m tests.benchmark.hard_cases``. What differs from the record is marked: counts by more than
a fifth, the outcome, the angle by more than 1e-6. ``--without NAME`` turns a heuristic off, and ``--set
GROUP.OPTION=VALUE`` changes an option of `fem_reference.solver.SolverOptions`. ``--record`` writes the record
anew, each case as soon as it is solved.
"""

import argparse
import ast
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax

from fem_reference import prepare_process
from fem_reference.solver import SolverOptions
from tests.benchmark.hard_cases.cases import CASES
from tests.benchmark.hard_cases.heuristics import WITHOUT
from tests.benchmark.hard_cases.outcome import Outcome

RECORD = Path(__file__).with_name("recorded.json")
COMPILED = Path(__file__).parents[3] / "build" / "compiled" / "hard_cases"


def changed_options(settings: dict[str, Any]) -> SolverOptions:
    """Options with some changed, by their group and name."""
    options = SolverOptions()
    for key, value in settings.items():
        group, _, name = key.partition(".")
        changed = replace(getattr(options, group), **{name: value})
        options = replace(options, **{group: changed})
    return options


def _setting(text: str) -> tuple[str, Any]:
    key, _, value = text.partition("=")
    try:
        changed_options({key: ast.literal_eval(value)})
    except (AttributeError, TypeError, ValueError, SyntaxError) as error:
        raise argparse.ArgumentTypeError(
            f"got {text!r}, expected GROUP.OPTION=VALUE, such as anderson.depth=4: {error}"
        ) from error
    return key, ast.literal_eval(value)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=list(CASES), metavar="NAME", help="these cases alone")
    parser.add_argument(
        "--without", action="append", default=[], choices=list(WITHOUT), help="a heuristic to turn off"
    )
    parser.add_argument(
        "--set", action="append", default=[], type=_setting, metavar="GROUP.OPTION=VALUE", help="an option"
    )
    parser.add_argument("--record", action="store_true", help="write the outcomes to the record")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def recorded_outcomes() -> dict[str, Outcome]:
    """The recorded outcome of every case that has one."""
    if not RECORD.exists():
        return {}
    return {name: Outcome(**outcome) for name, outcome in json.loads(RECORD.read_text()).items()}


def _write(outcomes: dict[str, Outcome]) -> None:
    """Replace the record by a whole file, cases in their order."""
    text = json.dumps({name: outcomes[name].record() for name in CASES if name in outcomes}, indent=1)
    whole = RECORD.with_suffix(".json.new")
    whole.write_text(text + "\n")
    whole.replace(RECORD)


def _line(name: str, found: Outcome, before: Outcome | None) -> str:
    row = (
        f"{name:22s} {found.iterations:5d} {found.factorisations:6d} {found.seconds:7.1f}  "
        f"{found.outcome:9s} {found.angle_deg:10.5f}  {found.jumps}"
    )
    if before is None:
        return f"{row}  * not recorded"
    changes = [f"{name} was {getattr(before, name)}" for name in found.changes(before)]
    return row + ("  * " + ", ".join(changes) if changes else "")


def main() -> int:
    """Solve the cases and print what became of each."""
    arguments = _parser().parse_args()
    settings = {key: value for name in arguments.without for key, value in WITHOUT[name].items()}
    options = changed_options(settings | dict(arguments.set))
    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_compilation_cache_dir", str(COMPILED))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.3)
    prepare_process()
    names = arguments.only or list(CASES)
    recorded, found, status = recorded_outcomes(), {}, 0
    if not arguments.json:
        print(f"{'case':22s} {'iter.':>5s} {'fact.':>6s} {'s':>7s}  {'outcome':9s} {'angle/deg':>10s}  jumps")
    try:
        for number, name in enumerate(names, start=1):
            if sys.stderr.isatty():
                print(f"\r{number} of {len(names)}: {name}\033[K\r", end="", file=sys.stderr, flush=True)
            found[name] = CASES[name].solve(options)
            if not arguments.json:
                print(_line(name, found[name], recorded.get(name)), flush=True)
            if arguments.record:
                _write(recorded | found)
    except KeyboardInterrupt:
        status = 130
    changed = {name: outcome.changes(recorded[name]) for name, outcome in found.items() if name in recorded}
    if arguments.json:
        rows = {
            name: {"why": CASES[name].why} | outcome.record() | {"changed": changed.get(name)}
            for name, outcome in found.items()
        }
        json.dump({"cases": rows, "settings": settings | dict(arguments.set)}, sys.stdout)
        print()
    else:
        print(
            f"{len(found)} of {len(names)} cases: {sum(o.iterations for o in found.values())} iterations, "
            f"{sum(o.factorisations for o in found.values())} factorisations; "
            f"{sum(map(bool, changed.values()))} changed"
        )
    return status


if __name__ == "__main__":
    sys.exit(main())
