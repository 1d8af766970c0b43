"""Write docs/reference/benchmark.md's tables and its picture from what the benchmarks have kept.

Run as ``python -m tests.benchmark.page``, after `bench_rod`, `bench_processes`, `bench_inverse`,
`bench_branches`, `bench_loads` and `bench_peers`, as ``make bench`` does. A table whose benchmark has kept
nothing stays as it is.
"""

import json
from collections.abc import Callable
from typing import Any

from tests.benchmark import bench_peers
from tests.benchmark.timing.figures import KEPT, ROOT, Figure, table
from tests.benchmark.timing.speed_picture import draw

PAGE = ROOT / "docs" / "reference" / "benchmark.md"
PICTURE = ROOT / "docs" / "images" / "speed_against_error.png"


def write_measured(name: str, text: str) -> None:
    """Put a text between the marks of that name, in place of what was measured before."""
    begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->\n"
    page = PAGE.read_text()
    if begin not in page or end not in page:
        raise ValueError(f"name: got {name!r}, expected one with marks in {PAGE.name}")
    before, _, rest = page.partition(begin)
    _, _, after = rest.partition(end)
    PAGE.write_text(before + begin + text + end + after)


def of_figures(record: dict[str, Any]) -> str:
    """Table of figures, and where they were measured."""
    return f"{table([Figure(**figure) for figure in record['figures']])}\n{record['where']}\n"


def of_loads(record: dict[str, Any]) -> str:
    """Table of the share that converges: a line a sheet of a law, a column a kind of load."""
    found = {(row["law"], row["sheet"], row["kind"]): row for row in record["rows"]}
    sheets = list(dict.fromkeys((row["law"], row["sheet"]) for row in record["rows"]))
    kinds = list(dict.fromkeys(row["kind"] for row in record["rows"]))
    lines = ["| law | sheet | " + " | ".join(kinds) + " |", "|---|---|" + "---|" * len(kinds)]
    lines += [
        "| " + " | ".join([*sheet, *(_share(found[*sheet, kind]) for kind in kinds)]) + " |"
        for sheet in sheets
    ]
    bad = sum(row["not_finite"] for row in record["rows"])
    told = f"{record['cases']} cases each; {bad} that converged hold a number that is not finite."
    return "\n".join([*lines, "", f"{told} {record['where']}", ""])


def _share(row: dict[str, Any]) -> str:
    failures = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in row["failures"].items())
    return f"{row['converged_percent']:.2f} % ({failures})" if failures else "100 %"


def of_peers(record: dict[str, Any]) -> str:
    """Table of the solvers, then that of ratios."""
    return f"{bench_peers.table(record['rows'])}\n{of_figures(record)}"


#: By the name of a record and of its marks in the page.
TABLES: dict[str, Callable[[dict[str, Any]], str]] = {
    "peers": of_peers,
    "rod": of_figures,
    "processes": of_figures,
    "inverse": of_figures,
    "branches": of_figures,
    "loads": of_loads,
}


def write() -> list[str]:
    """Write the tables that have a record; the names of those that have none come back."""
    absent = []
    for name, text_of in TABLES.items():
        file = KEPT / f"{name}.json"
        if not file.exists():
            absent.append(name)
            continue
        record = json.loads(file.read_text())
        write_measured(name, text_of(record))
        if name == "peers":
            draw([row for row in record["rows"] if "failure" not in row], PICTURE)
    return absent


if __name__ == "__main__":
    for missing in write():
        print(f"{missing}: not in {KEPT.relative_to(ROOT)}, so its table stays; run bench_{missing}")
