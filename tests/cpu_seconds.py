"""What the tests cost: CPU seconds by folder and file, with the processes that they start.

`python -m pytest -p tests.cpu_seconds` prints them. Where others use the machine too, the clock says less.
"""

import resource
from collections import defaultdict
from pathlib import Path

import pytest

_NAME = "cpu_seconds"
_seen = {"last": 0.0}
_by_test: dict[str, float] = defaultdict(float)


def _used() -> float:
    """CPU seconds of this process and of those that it waited for."""
    return sum(
        usage.ru_utime + usage.ru_stime
        for usage in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    )


def pytest_collection_finish():
    """Imports belong to no test."""
    _seen["last"] = _used()
    _by_test["collection"] = _seen["last"]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport():
    """What setup, call or teardown used goes with its report, from a worker too."""
    report = yield
    now = _used()
    report.user_properties.append((_NAME, now - _seen["last"]))
    _seen["last"] = now
    return report


def pytest_runtest_logreport(report):
    """Add up a test's three reports."""
    _by_test[report.nodeid] += dict(report.user_properties).get(_NAME, 0.0)


def pytest_terminal_summary(terminalreporter):
    """Folders, then files, then the dearest tests."""
    folders: dict[str, float] = defaultdict(float)
    files: dict[str, float] = defaultdict(float)
    for test, seconds in _by_test.items():
        file = test.partition("::")[0]
        files[file] += seconds
        folders[str(Path(file).parent)] += seconds
    for title, table, most in (
        ("folder", folders, None),
        ("file", files, 40),
        ("test", _by_test, 40),
    ):
        terminalreporter.section(f"CPU seconds by {title}: {sum(table.values()):.0f}")
        for name in sorted(table, key=table.get, reverse=True)[:most]:
            terminalreporter.line(f"{table[name]:8.1f}  {name}")
