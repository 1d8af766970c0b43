"""One HTML page that needs nothing else: figures are in it, and no network."""

import base64
import html
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

_STYLE = """
body { font: 16px/1.45 sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #222; }
table { border-collapse: collapse; margin: 1em 0; }
td, th { border: 1px solid #bbb; padding: 0.25em 0.7em; text-align: right; }
td:first-child, th:first-child { text-align: left; }
img { max-width: 100%; }
pre { background: #f4f4f4; padding: 0.8em; overflow-x: auto; }
"""


@dataclass
class Section:
    """One section of the page, in the order of its content.

    Parameters
    ----------
    title : heading.
    """

    title: str
    _parts: list[str] = field(default_factory=list)

    def text(self, words: str) -> "Section":
        """Add a paragraph."""
        self._parts.append(f"<p>{html.escape(words)}</p>")
        return self

    def code(self, words: str) -> "Section":
        """Add preformatted text."""
        self._parts.append(f"<pre>{html.escape(words)}</pre>")
        return self

    def table(self, head: Sequence[str], rows: Iterable[Sequence[str]]) -> "Section":
        """Add a table."""
        lines = [_row("th", head), *(_row("td", row) for row in rows)]
        self._parts.append(f"<table>\n{''.join(lines)}</table>")
        return self

    def figure(self, name: str, content: bytes) -> "Section":
        """Add a PNG."""
        data = base64.b64encode(content).decode("ascii")
        self._parts.append(f'<p><img alt="{html.escape(name)}" src="data:image/png;base64,{data}"></p>')
        return self

    def html(self) -> str:
        """Return the section."""
        return f"<h2>{html.escape(self.title)}</h2>\n" + "\n".join(self._parts) + "\n"


def page(title: str, sections: Sequence[Section]) -> str:
    """Return the page."""
    body = "".join(section.html() for section in sections)
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f"<title>{html.escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n<h1>{html.escape(title)}</h1>\n{body}</body>\n</html>\n"
    )


def pairs(content: Mapping[str, Any], most: int = 300) -> list[tuple[str, str]]:
    """Return the entries of nested mappings as names and texts for a table; long texts are cut."""
    rows = []
    for name, value in content.items():
        if isinstance(value, Mapping):
            rows += [(f"{name}: {inner}", text) for inner, text in pairs(value, most)]
        else:
            text = f"{value:.6g}" if isinstance(value, float) else str(value)
            rows.append((name, text if len(text) <= most else f"{text[:most]} …"))
    return rows


def _row(cell: str, values: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<{cell}>{html.escape(value)}</{cell}>" for value in values) + "</tr>\n"
