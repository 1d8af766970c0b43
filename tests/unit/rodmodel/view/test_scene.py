"""Faces of solids: turned outward, hidden where they are behind, in whatever order they come."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from rodmodel.view.scene import Camera, Faces, arrow, disc, paint, plate, rod, tube

AROUND = 24


def volume(faces: Faces) -> float:
    """By the divergence theorem; positive where the faces are counter-clockwise from outside."""
    a, b, c, d = np.moveaxis(faces.corners, 1, 0)
    triangles = [(a, b, c), (a, c, d)]
    return float(sum(np.einsum("ni,ni->n", x, np.cross(y, z)).sum() for x, y, z in triangles) / 6.0)


def straight_tube(centre: tuple[float, float], colour: str, radius: float = 1.0) -> Faces:
    stations = np.stack([[*centre, z] for z in np.linspace(-4.0, 4.0, 17)])
    frames = np.repeat(np.eye(3)[None], 17, axis=0)
    return tube(stations, frames, radius, np.tile(to_rgb(colour), (16, AROUND, 1)))


def test_faces_of_a_tube_are_turned_outward() -> None:
    body = straight_tube((0.0, 0.0), "red")
    closed = Faces.joined([body, disc(np.array([0.0, 0.0, -4.0]), np.array([0.0, 0.0, -1.0]), 1.0, "red")])
    # A prism over a polygon of 24 corners; the lower disc has 16.
    assert volume(closed) == pytest.approx(np.pi * 8.0, rel=0.03)


@pytest.mark.parametrize("heads", [1, 2])
def test_faces_of_an_arrow_are_turned_outward(heads: int) -> None:
    solid = arrow(np.array([1.0, 2.0, 3.0]), np.array([11.0, 2.0, 8.0]), 0.5, "red", heads)
    length = np.hypot(10.0, 5.0)
    cone = np.pi * 1.3**2 * 2.5 / 3.0
    assert volume(solid) == pytest.approx(np.pi * 0.25 * (length - 2.5 * heads) + heads * cone, rel=0.1)


def test_faces_of_a_plate_are_turned_outward() -> None:
    solid = plate(np.array([5.0, -2.0, 1.0]), np.eye(3), (0.0, 10.0), "red")
    assert volume(solid) == pytest.approx(np.pi * 100.0 * 3.0, rel=0.01)


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("azimuth", [0.0, 1.0, np.pi])
def test_the_body_nearer_to_the_eye_hides_the_other(order: int, azimuth: float) -> None:
    eye = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    near, far = 5.0 * eye[:2], -5.0 * eye[:2]
    bodies = [straight_tube((near[0], near[1]), "red"), straight_tube((far[0], far[1]), "blue")]
    figure = Figure(figsize=(1.0, 1.0), dpi=80)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(-0.8, 0.8), ylim=(-0.8, 0.8))
    axes.axis("off")
    camera = Camera.towards(eye, (0.0, 0.0, 1.0))
    paint(axes, camera, Faces.joined(bodies[::order]), camera.eye)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[:, :, :3].astype(int)
    assert np.all(pixels[:, :, 0] > 100)
    assert np.all(pixels[:, :, 2] < 20)


def test_a_bar_follows_its_curve() -> None:
    angle = np.linspace(0.0, 1.5, 40)
    curve = np.stack([10.0 * np.cos(angle), np.zeros(40), 10.0 * np.sin(angle)], axis=1)
    corners = rod(curve, 0.2, "red").corners[: 39 * 16]
    away = np.linalg.norm(corners.mean(axis=1)[:, None] - curve[None], axis=2).min(axis=1)
    assert away.max() < 0.3


@pytest.mark.parametrize("eye", [(1.0, 0.0, 0.3), (-1.0, 2.0, 0.0), (0.2, 0.0, -1.0)])
def test_a_camera_is_a_right_handed_frame(eye: tuple[float, float, float]) -> None:
    frame = np.stack(Camera.towards(eye, (0.0, 0.0, 1.0)))
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    assert frame[1, 2] > 0.0
