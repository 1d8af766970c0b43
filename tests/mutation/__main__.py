"""Put faults into the equations, one at a time, and see which of them the tests find.

    python -m tests.mutation                          all subjects, hours
    python -m tests.mutation ridge-law --sample 40    some mutants of one

Prints a table and the mutants that survived. Ends with status 1 where a score is below the bar. Verdicts
are kept in build/mutants until the module or its tests change.
"""

import argparse
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from queue import SimpleQueue

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from tests.mutation.mutants import Mutant, mutants, sample
from tests.mutation.sandbox import ROOT, Sandbox, SandboxError, Verdict
from tests.mutation.subjects import SUBJECTS, Subject
from tests.mutation.verdicts import Verdicts

#: Least share of the mutants that the tests must find.
BAR = 0.85


class _Rate(ProgressColumn):
    """Mutants a minute."""

    def render(self, task: Task) -> Text:
        return Text("" if task.speed is None else f"{60.0 * task.speed:.1f}/min")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="tests.mutation", description=__doc__.splitlines()[0])
    parser.add_argument("subjects", nargs="*", metavar="subject", help=f"any of {', '.join(SUBJECTS)}")
    parser.add_argument(
        "--sample", type=int, metavar="N", help="so many mutants of each, the same on every run"
    )
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="runs of tests side by side")
    options = parser.parse_args()
    for name in options.subjects:
        if name not in SUBJECTS:
            parser.error(f"subject: got {name!r}, expected any of {', '.join(SUBJECTS)}")
    return options


def _judged(
    subject: Subject, waiting: list[Mutant], sandboxes: list[Sandbox]
) -> Iterator[tuple[Mutant, Verdict]]:
    """Yield each mutant with its verdict, as they come: one run of tests in each sandbox."""
    limit = sandboxes[0].limit(subject)
    free: SimpleQueue[Sandbox] = SimpleQueue()
    for sandbox in sandboxes:
        free.put(sandbox)

    def judge(mutant: Mutant) -> Verdict:
        sandbox = free.get()
        try:
            return sandbox.judge(subject, mutant.source, limit)
        finally:
            free.put(sandbox)

    with ThreadPoolExecutor(len(sandboxes)) as pool:
        running = {pool.submit(judge, mutant): mutant for mutant in waiting}
        try:
            for done in as_completed(running):
                yield running[done], done.result()
        finally:
            pool.shutdown(cancel_futures=True)


def _report(results: dict[str, list[tuple[Mutant, Verdict]]]) -> bool:
    """Print scores and survivors, and return whether every score is at the bar."""
    print(
        f"{'subject':<15}{'mutants':>8}{'killed':>8}{'timeout':>9}{'survived':>10}{'score':>8}{'minutes':>9}"
    )
    good = True
    for name, result in results.items():
        outcomes = [verdict.outcome for _, verdict in result]
        killed, timeout, survived = (outcomes.count(kind) for kind in ("killed", "timeout", "survived"))
        # A test that never ends is a fault found.
        score = (killed + timeout) / len(result)
        minutes = sum(verdict.seconds for _, verdict in result) / 60.0
        print(f"{name:<15}{len(result):>8}{killed:>8}{timeout:>9}{survived:>10}{score:>8.0%}{minutes:>9.1f}")
        good = good and score >= BAR
    for name, result in results.items():
        for mutant, verdict in result:
            if verdict.outcome == "survived":
                print(f"\n{SUBJECTS[name].module}:{mutant.line}\n  - {mutant.old}\n  + {mutant.new}")
    return good


def main() -> int:
    """Judge the mutants of each subject that is asked for."""
    options = _arguments()
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        _Rate(),
        TimeRemainingColumn(),
    )
    results: dict[str, list[tuple[Mutant, Verdict]]] = {}
    with (
        tempfile.TemporaryDirectory(prefix="mutants-") as folder,
        Progress(*columns, console=console, disable=not console.is_terminal) as progress,
    ):
        sandboxes = [Sandbox(Path(folder) / str(n)) for n in range(options.jobs)]
        for name in options.subjects or SUBJECTS:
            subject = SUBJECTS[name]
            population = mutants((ROOT / subject.module).read_text())
            chosen = population if options.sample is None else sample(population, options.sample)
            verdicts = Verdicts(subject)
            waiting = [mutant for mutant in chosen if verdicts.of(mutant) is None]
            bar = progress.add_task(name, total=len(waiting))
            try:
                for mutant, verdict in _judged(subject, waiting, sandboxes) if waiting else ():
                    verdicts.add(mutant, verdict)
                    progress.advance(bar)
            except SandboxError as error:
                console.print(str(error), style="red", highlight=False)
                return 2
            results[name] = [(m, v) for m in chosen if (v := verdicts.of(m)) is not None]
    return 0 if _report(results) else 1


if __name__ == "__main__":
    sys.exit(main())
