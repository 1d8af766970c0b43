"""Where docs/benchmark.md keeps what was measured."""

from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "benchmark.md"


def write_measured(name: str, text: str) -> None:
    """Put a text between the marks of that name, in place of what was measured before."""
    begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->\n"
    page = PAGE.read_text()
    if begin not in page or end not in page:
        raise ValueError(f"name: got {name!r}, expected one with marks in {PAGE.name}")
    before, _, rest = page.partition(begin)
    _, _, after = rest.partition(end)
    PAGE.write_text(before + begin + text + end + after)
