"""One HTML page that needs nothing else."""

import base64
import re
from html.parser import HTMLParser

import matplotlib.pyplot as plt

from calibration.from_design.figures import png
from calibration.report import Section, page, pairs


def test_a_page_holds_its_figures_and_fetches_nothing():
    figure, _ = plt.subplots()
    content = png(figure)
    text = page("A calibration", [Section("Figures").figure("a figure", content)])
    (data,) = re.findall(r'src="data:image/png;base64,([^"]*)"', text)
    assert base64.b64decode(data) == content
    assert content.startswith(b"\x89PNG")
    assert "http" not in text
    assert "<script" not in text


def test_text_is_shown_as_it_is():
    """What looks like HTML in a name is text; every tag is closed."""
    section = Section("A & B").text("a < b").code("<b>").table(("head", "<i>"), [("x", '"y"')])
    text = page("<title>", [section])
    for shown in ("A &amp; B", "a &lt; b", "&lt;b&gt;", "&lt;i&gt;", "&lt;title&gt;"):
        assert shown in text
    parser = _Balance()
    parser.feed(text)
    assert parser.open == []


class _Balance(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag, attrs):
        if tag not in ("meta", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_nested_entries_become_rows():
    rows = pairs({"mesh": "fine", "fit": {"states": 3, "loss": 1 / 3}, "text": "x" * 1000}, most=10)
    assert rows[:3] == [("mesh", "fine"), ("fit: states", "3"), ("fit: loss", "0.333333")]
    assert rows[3] == ("text", "x" * 10 + " …")
