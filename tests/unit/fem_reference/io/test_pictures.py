"""Pictures of the cell and of the actuator: what they say, and that what is in front is what is seen."""

import json

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from fem_reference import LEVELS, Actuator, ActuatorGeometry, ActuatorLoad, CellState, PeriodCell
from fem_reference.cli import main
from fem_reference.io import draw_actuator, draw_cell
from fem_reference.io.picture import across, paint, thread_faces
from tests.fem_fixtures import TINY


@pytest.fixture(autouse=True)
def text_as_text(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not as outlines."""
    monkeypatch.setitem(matplotlib.rcParams, "svg.fonttype", "none")


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(LEVELS, "coarse", TINY)


def test_the_cell_is_drawn_with_its_angle_and_curves(tmp_path, capsys):
    file = tmp_path / "cell.svg"
    assert main(["cell", "--pressure-kpa", "4", "1", "0", "--json", "--plot", str(file)]) == 0
    told = json.loads(capsys.readouterr().out)
    text = file.read_text()
    assert f"θ = {told['bending_angle_deg']:.1f}°, γ = {told['bending_plane_deg']:.1f}°" in text
    for wanted in (
        "4 kPa",
        "1 kPa",
        "0 kPa",
        "pressure in chamber 1 [kPa]",
        "curvature, twist [1/m]",
        "[mm³]",
    ):
        assert wanted in text
    assert "moment" not in text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("loads", "name"),
    [
        (["--curvature-per-m", "1", "-2", "0.5"], "size of the curvature [1/m]"),
        (["--moment-nmm", "0", "-0.5", "0"], "size of the moment [N mm]"),
    ],
)
def test_a_load_without_pressure_is_drawn_in_steps_with_its_moment(loads, name, tmp_path, capsys):
    file = tmp_path / "cell.svg"
    assert main(["cell", "--pressure-kpa", "0", "0", "0", *loads, "--plot", str(file)]) == 0
    text = file.read_text()
    assert name in text
    assert "moment [N mm]" in text


@pytest.mark.slow
def test_the_picture_does_not_change_the_answer(tmp_path, capsys):
    plain, drawn = (
        main(["cell", "--pressure-kpa", "3", "0", "0", "--json", *more])
        or json.loads(capsys.readouterr().out)
        for more in ([], ["--plot", str(tmp_path / "cell.png")])
    )
    assert drawn["bending_angle_deg"] == pytest.approx(plain["bending_angle_deg"], rel=1e-5)
    assert (tmp_path / "cell.png").read_bytes().startswith(b"\x89PNG")


def test_no_states_are_refused(tmp_path):
    cell = PeriodCell(level=TINY)
    states: list[CellState] = []
    with pytest.raises(ValueError, match="states: got none, expected at least one"):
        draw_cell(cell, states, tmp_path / "cell.png")


def test_the_actuator_is_drawn_with_angle_tip_and_loads(tmp_path):
    actuator = Actuator(ActuatorGeometry(body_length=3e-3, cap_length=2e-3), level=TINY)
    load = ActuatorLoad((4e3, 0.0, 0.0), tip_force=(0.0, 0.001, 0.0), gravity=(0.0, 0.0, -9.81))
    (state,) = actuator.follow([load])
    file = tmp_path / "bent.svg"
    draw_actuator(actuator, state, file)
    text = file.read_text()
    assert f"θ = {np.degrees(state.bending_angle):.1f}°" in text
    assert f"γ = {np.degrees(state.bending_plane):.1f}°" in text
    assert "tip force (0, 0.001, 0) N, gravity (0, 0, −9.81) m/s²" in text
    assert "4 / 0 / 0 kPa" in text


def cube(centre: tuple[float, float, float]) -> np.ndarray:
    """Faces of a cube of 2 mm, counter-clockwise from outside."""
    faces = []
    for axis in range(3):
        e, f, g = np.roll(np.eye(3), -axis, axis=0)
        for sign in (1.0, -1.0):
            ring = [f + sign * g, -f + sign * g, -f - sign * g, f - sign * g]
            faces.append([sign * e + corner for corner in ring])
    return np.array(faces) + centre


def test_faces_of_a_cube_are_turned_outward():
    corners = cube((0.0, 0.0, 0.0))
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    assert np.all(np.einsum("ni,ni->n", normals, corners.mean(axis=1)) > 0.0)


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("plane", [0.0, 2.0])
def test_the_body_nearer_to_the_eye_is_seen_and_the_thread_on_it(order, plane):
    view = across(plane)
    near, far = cube(tuple(4.0 * view.eye)), cube(tuple(-4.0 * view.eye))
    bodies = [(near, "red"), (far, "blue")][::order]
    for thread in (False, True):
        if thread:
            line = 4.0 * view.eye + np.outer(np.linspace(-0.5, 0.5, 6), view.right) + view.eye
            bodies.append((thread_faces(line, [np.arange(6)], near, view), "#00ff00"))
        figure = Figure(figsize=(1.0, 1.0), dpi=80)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(-0.4, 0.4), ylim=(-0.4, 0.4))
        axes.axis("off")
        paint(axes, view, bodies)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        pixels = np.asarray(canvas.buffer_rgba())[:, :, :3].astype(int)
        assert pixels[:, :, 2].max() < 20
        green = pixels[:, :, 1] > 100
        assert green.any() == thread
        assert np.all(pixels[~green][:, 0] > 20)
