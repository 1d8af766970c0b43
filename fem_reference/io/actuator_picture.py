"""Picture of the deformed actuator: its shaded outer skin with the winding."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from fem_reference.actuator import Actuator, ActuatorState
from fem_reference.io.atomic import atomic_part
from fem_reference.io.picture import SILICONE, THREAD, across, paint, thread_faces
from fem_reference.mesh import OUTER, TOP, cut

# Below this bending angle the body is straight and its bending plane is round-off [rad].
_STRAIGHT = 1e-6


def draw_actuator(actuator: Actuator, state: ActuatorState, file: str | Path) -> None:
    """Write a picture of the deformed actuator in its bending plane; the suffix chooses the format.

    Its lengths are in mm.
    """
    equations = actuator.equations
    x = state.deformation.positions
    mesh = equations.mesh
    quads = np.concatenate([cut(mesh.oriented(name), mesh.order) for name in (OUTER, TOP)])
    # Their normals point into the elements.
    skin = x[quads][:, ::-1]
    straight = state.bending_angle < _STRAIGHT
    view = across(0.0 if straight else state.bending_plane)
    thread = thread_faces(equations.thread.points(x), equations.thread.polylines, skin, view)

    figure = Figure(figsize=(7.0, 6.0), layout="constrained")
    axes = figure.add_subplot()
    millimetre = 1e3 * equations.units.millimetre
    paint(axes, view, [(millimetre * skin, SILICONE), (millimetre * thread, THREAD)])
    axes.autoscale_view()
    plane = "straight" if straight else f"γ = {np.rad2deg(state.bending_plane):.1f}°"
    axes.set(
        aspect="equal",
        xlabel="−x [mm]" if straight else f"in the bending plane, {plane} [mm]",
        ylabel="z [mm]",
        title=f"{' / '.join(f'{p / 1e3:.4g}' for p in state.load.pressure)} kPa: "
        f"θ = {np.rad2deg(state.bending_angle):.1f}°, "
        f"tip ({', '.join(_coordinate(c) for c in 1e3 * state.tip_position)}) mm" + _loads(state),
    )
    axes.grid(alpha=0.3)
    axes.set_axisbelow(True)
    with atomic_part(file) as part:
        figure.savefig(part, dpi=150, format=Path(file).suffix[1:])


def _coordinate(value: float) -> str:
    return f"{round(value, 1) + 0.0:.1f}".replace("-", "−")


def _loads(state: ActuatorState) -> str:
    """Return tip loads and gravity on a separate line; empty without any."""
    load = state.load
    follower = ", turning with the cap" if load.follower else ""
    named = (
        ("tip force", load.tip_force, 1.0, f"N{follower}"),
        ("tip moment", load.tip_moment, 1e3, f"N mm{follower}"),
        ("gravity", load.gravity, 1.0, "m/s²"),
    )
    texts = [
        f"{name} ({', '.join(f'{unit * c:.3g}'.replace('-', '−') for c in vector)}) {text}"
        for name, vector, unit, text in named
        if any(vector)
    ]
    return "\n" + ", ".join(texts) if texts else ""
