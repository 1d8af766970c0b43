"""Labels of a picture, put where nothing else is."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

_TURNS = np.radians([0.0, 30.0, -30.0, 60.0, -60.0, 90.0, -90.0, 130.0, -130.0, 180.0])
_GAPS = (3.0, 6.0, 10.0, 16.0, 24.0)  # points
_PAD = 2.0  # points
_OUTSIDE, _ON_LABEL = 1e6, 1e3


class Label(NamedTuple):
    """Text beside `anchor`, rather in the direction `way`; both in the axes' data."""

    anchor: np.ndarray
    way: np.ndarray
    text: str
    colour: str = "black"
    size: float = 9.0


def place_labels(axes: Axes, labels: Sequence[Label], drawn: np.ndarray, per_point: float) -> None:
    """Write labels clear of each other, of what is drawn and of the axes' edges, as near as that allows.

    Parameters
    ----------
    axes : with their limits set.
    labels : the first ones are placed first.
    drawn : points (n, 2) of what is drawn, dense enough that no label lies between them.
    per_point : length in the axes' data of a typographic point.
    """
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    taken: list[tuple[np.ndarray, np.ndarray]] = []
    for label in labels:
        half = per_point * _half_extent(label)
        best, least = np.asarray(label.anchor), np.inf
        for gap in _GAPS:
            for turn in _TURNS:
                way = _turned(label.way, turn)
                centre = label.anchor + way * (per_point * gap + np.abs(way) @ half)
                outside = np.any(centre - half < (left, bottom)) or np.any(centre + half > (right, top))
                score = _OUTSIDE * bool(outside)
                score += _ON_LABEL * sum(bool(np.all(np.abs(centre - c) < half + h)) for c, h in taken)
                score += np.count_nonzero(np.all(np.abs(drawn - centre) < half, axis=1))
                if score < least:
                    best, least = centre, score
            if least == 0.0:
                break
        taken.append((best, half))
        axes.text(
            best[0],
            best[1],
            label.text,
            fontsize=label.size,
            color=label.colour,
            ha="center",
            va="center",
            zorder=5,
        )


def _half_extent(label: Label) -> np.ndarray:
    """Half width and height of the text with some room [points]."""
    lines = label.text.split("\n")
    width = max(
        TextPath((0.0, 0.0), line, size=label.size, prop=FontProperties()).get_extents().width
        for line in lines
    )
    return np.array([0.5 * width + _PAD, 0.6 * label.size * len(lines) + 0.5 * _PAD])


def _turned(way: np.ndarray, angle: float) -> np.ndarray:
    size = np.linalg.norm(way)
    x, y = (way / size) if size > 1e-9 else (0.0, 1.0)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * x - s * y, s * x + c * y])
