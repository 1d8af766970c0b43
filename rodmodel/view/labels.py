"""Placement of labels in the free space of a picture."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

# Positions tried for a label: angles from the preferred direction, and gaps to the anchor [points].
_TURNS = np.radians([0.0, 30.0, -30.0, 60.0, -60.0, 90.0, -90.0, 130.0, -130.0, 180.0])
_GAPS = (3.0, 6.0, 10.0, 16.0, 24.0)
# Space around a text [points].
_PAD = 2.0
# Penalties of a position outside the axes, and on another label; a covered point costs one.
_OUTSIDE, _ON_LABEL = 1e6, 1e3


class Label(NamedTuple):
    """Text beside `anchor`, preferably in `direction`; both in data coordinates."""

    anchor: np.ndarray
    direction: np.ndarray
    text: str
    colour: str = "black"
    size: float = 9.0


def place_labels(axes: Axes, labels: Sequence[Label], drawn: np.ndarray, per_point: float) -> None:
    """Write labels near their anchors, clear of each other, of the drawing and of the axes' edges.

    Parameters
    ----------
    axes : axes with their limits set.
    labels : labels in the order of their placement.
    drawn : points of the drawing, (n, 2), dense enough that no label fits between them.
    per_point : length of a typographic point in data coordinates.
    """
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    placed: list[tuple[np.ndarray, np.ndarray]] = []
    for label in labels:
        half = per_point * _half_extent(label)
        best, least = np.asarray(label.anchor), np.inf
        for gap in _GAPS:
            for turn in _TURNS:
                direction = _turned(label.direction, turn)
                centre = label.anchor + direction * (per_point * gap + np.abs(direction) @ half)
                outside = np.any(centre - half < (left, bottom)) or np.any(centre + half > (right, top))
                score = _OUTSIDE * bool(outside)
                score += _ON_LABEL * sum(bool(np.all(np.abs(centre - c) < half + h)) for c, h in placed)
                score += np.count_nonzero(np.all(np.abs(drawn - centre) < half, axis=1))
                if score < least:
                    best, least = centre, score
            if least == 0.0:
                break
        placed.append((best, half))
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
    """Return half of the padded text's width and height [points]."""
    lines = label.text.split("\n")
    width = max(
        TextPath((0.0, 0.0), line, size=label.size, prop=FontProperties()).get_extents().width
        for line in lines
    )
    return np.array([0.5 * width + _PAD, 0.6 * label.size * len(lines) + 0.5 * _PAD])


def _turned(direction: np.ndarray, angle: float) -> np.ndarray:
    """Return the unit vector of a direction turned by an angle; upwards for a zero vector."""
    size = np.linalg.norm(direction)
    x, y = (direction / size) if size > 1e-9 else (0.0, 1.0)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * x - s * y, s * x + c * y])
