"""VTK files of cell states for ParaView: deformed hexahedra, and the winding as lines."""

from pathlib import Path

import meshio
import numpy as np

from fem_reference.cell import CellState, PeriodCell
from fem_reference.io.atomic import atomic_part
from fem_reference.mesh import VTK_HEXAHEDRON

_MM, _KPA = 1e3, 1e-3
BODY, WINDING = 0, 1


def write_vtk(cell: PeriodCell, state: CellState, file: str | Path, periods: int = 1) -> None:
    """Write the deformed cell as an unstructured grid in millimetres.

    Point data: ``displacement_mm``, so that ParaView's *Warp By Vector* with a factor of −1 gives the rest
    shape. Cell data: ``part`` (0 body, 1 winding), ``pressure_kpa`` (mean pressure in the silicone, positive
    in compression) and ``tension_n`` (tension of the thread).

    Parameters
    ----------
    cell, state : the cell and one of its states.
    file : path of the file; its suffix selects the format.
    periods : number of periods along the rod, each the image of the one before.

    Raises
    ------
    ValueError
        If the suffix is neither ``.vtu`` nor ``.vtk``, or for fewer than one period.
    """
    file = Path(file)
    if file.suffix not in (".vtu", ".vtk"):
        raise ValueError(f"file: got {file.name!r}, expected a name that ends in .vtu or .vtk")
    if periods < 1:
        raise ValueError(f"periods: got {periods}, expected at least 1")
    equations, units = cell.equations, cell.equations.units
    body_points = equations.mesh.points
    rest = np.concatenate([body_points, equations.thread.points(equations.helical.continued.points)])
    nodes = equations.all_positions(state.configuration)
    moved = np.concatenate([nodes[: len(body_points)], equations.thread.points(nodes)])
    hexes = equations.mesh.cells[:, VTK_HEXAHEDRON]
    lines = len(body_points) + equations.thread.segments
    turn, shift = equations.period_motion(state.configuration)

    at_rest, deformed, hex_cells, line_cells = [], [], [], []
    for k in range(periods):
        at_rest.append(rest + np.array([0.0, 0.0, k * equations.period]))
        deformed.append(moved)
        hex_cells.append(hexes + k * len(rest))
        line_cells.append(lines + k * len(rest))
        moved = moved @ turn.T + shift
    millimetre = _MM * units.millimetre
    points = millimetre * np.concatenate(deformed)
    body, winding = periods * len(hexes), periods * len(lines)
    # The element pressure is positive in tension.
    mean = _KPA * units.megapascal * state.configuration.element_pressure[:, 0]
    pressure = np.tile(np.repeat(-mean, equations.mesh.order**3), periods)
    tension = np.tile(units.newton * equations.thread.tension(nodes), periods)
    grid = meshio.Mesh(
        points,
        [("hexahedron", np.concatenate(hex_cells)), ("line", np.concatenate(line_cells))],
        point_data={"displacement_mm": points - millimetre * np.concatenate(at_rest)},
        cell_data={
            "part": [np.full(body, BODY), np.full(winding, WINDING)],
            "pressure_kpa": [pressure, np.zeros(winding)],
            "tension_n": [np.zeros(body), tension],
        },
    )
    with atomic_part(file) as part:
        grid.write(part, file_format=file.suffix[1:])
