"""The picture of a design shows its section, its winding and its body; no labels overlap."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Polygon
from scipy.spatial import cKDTree

from fem_reference.design import Design, design_figure
from fem_reference.geometry import ActuatorGeometry, DoubleHelix, NoWinding, Ring, SixHelix
from fem_reference.mesh import mesh_level

WINDINGS = (DoubleHelix(0.3, 4e-3), SixHelix(), Ring(), NoWinding())


@pytest.mark.parametrize("winding", WINDINGS, ids=lambda winding: winding.name)
def test_no_labels_overlap_and_none_are_cut(winding):
    figure = design_figure(Design(name="a design of some length, 12 mm", winding=winding))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    texts = [*figure.texts]
    for axes in figure.axes:
        texts += [axes.title, axes.xaxis.label, axes.yaxis.label, *axes.texts]
        for axis, (least, most) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            texts += [tick.label1 for tick in axis.get_major_ticks() if least <= tick.get_loc() <= most]
    boxes = [text.get_window_extent(renderer) for text in texts if text.get_text()]
    assert len(boxes) > 20
    page = figure.bbox
    for k, box in enumerate(boxes):
        assert page.x0 <= box.x0 <= box.x1 <= page.x1
        assert page.y0 <= box.y0 <= box.y1 <= page.y1
        assert not any(box.overlaps(other) for other in boxes[k + 1 :])


def test_chambers_have_the_areas_of_the_geometry():
    geometry = ActuatorGeometry(outer_wall_variation=(0.2, 0.0, -0.3))
    section = design_figure(Design(geometry=geometry)).axes[0]
    drawn = []
    for patch in section.patches:
        if isinstance(patch, Polygon):
            x, y = patch.get_xy().T
            drawn.append(0.5 * abs(x @ np.roll(y, 1) - y @ np.roll(x, 1)))
    # Arcs of forty points lack a share of their segments.
    np.testing.assert_allclose(drawn, 1e6 * np.array(geometry.chamber_areas), rtol=2e-3)


@pytest.mark.parametrize("winding", WINDINGS, ids=lambda winding: winding.name)
def test_the_unrolled_winding_has_the_threads_of_the_layout(winding):
    unrolled = design_figure(Design(winding=winding)).axes[1]
    lines = [line.get_xydata() for line in unrolled.lines]
    threads = winding.polylines(5.6e-3, 4.0 * winding.period, 120)
    assert bool(lines) == bool(threads)
    if threads:
        drawn = cKDTree(np.concatenate(lines))
        points = np.array([(np.degrees(np.arctan2(y, x)) % 360.0, 1e3 * z) for t in threads for x, y, z in t])
        assert drawn.query(points)[0].max() < 1e-6


def test_the_mesh_of_a_level_is_drawn_with_all_its_elements():
    bare, meshed = (design_figure(Design(), level).axes[0] for level in (None, mesh_level("coarse")))
    assert not bare.collections
    (edges,) = meshed.collections
    # Of each chamber and each partition: the walls inside and outside, and the partition's length.
    assert len(edges.get_paths()) == 3 * (2 * (4 + 4) + 4 * 4 + 3 * (12 + 4))
