"""Labels keep clear of each other, of what is drawn and of the edges."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rodmodel.view.labels import Label, place_labels


@pytest.mark.parametrize("count", [2, 6])
def test_labels_at_one_place_do_not_overlap(count: int) -> None:
    figure = Figure(figsize=(6.0, 6.0))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    per_point = 100.0 / (6.0 * 72.0)
    axes.set(xlim=(0.0, 100.0), ylim=(0.0, 100.0))
    drawn = np.stack([np.full(200, 50.0), np.linspace(0.0, 100.0, 200)], axis=1)
    anchor = np.array([50.0, 50.0])
    labels = [Label(anchor, np.array([0.0, 1.0]), f"load {n}, 9.81 m/s²") for n in range(count)]
    place_labels(axes, labels, drawn, per_point)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    boxes = [text.get_window_extent() for text in axes.texts]
    assert len(boxes) == count
    assert not any(a.overlaps(b) for n, a in enumerate(boxes) for b in boxes[:n])
    points = axes.transData.transform(drawn)
    assert not any(box.count_contains(points) for box in boxes)
    assert all(axes.bbox.containsx(x) for box in boxes for x in (box.x0, box.x1))


def test_a_label_stays_inside_the_axes() -> None:
    figure = Figure(figsize=(4.0, 4.0))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    place_labels(
        axes,
        [Label(np.array([0.99, 0.99]), np.array([1.0, 1.0]), "a label in a corner")],
        np.array([[0.99, 0.99]]),
        1.0 / 288.0,
    )
    FigureCanvasAgg(figure).draw()
    (text,) = axes.texts
    box = text.get_window_extent()
    assert 0.0 <= box.x0 < box.x1 <= axes.bbox.width
    assert 0.0 <= box.y0 < box.y1 <= axes.bbox.height
