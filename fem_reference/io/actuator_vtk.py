"""VTK files of actuator states for ParaView: deformed hexahedra, winding and rod as lines."""

from pathlib import Path

import meshio
import numpy as np

from fem_reference.actuator import Actuator, ActuatorLoad, ActuatorState
from fem_reference.io.atomic import atomic_part, write_atomically
from fem_reference.mesh import VTK_HEXAHEDRON

_MM, _KPA = 1e3, 1e-3
BODY, WINDING, ROD = 0, 1, 2


def write_actuator_vtk(actuator: Actuator, state: ActuatorState, file: str | Path) -> None:
    """Write the deformed actuator as an unstructured grid in millimetres.

    Point data: ``displacement_mm``. Cell data: ``part`` (0 body, 1 winding, 2 rod), ``pressure_kpa`` (mean
    pressure in the silicone, positive in compression) and ``tension_n`` (tension of thread and rod).

    Parameters
    ----------
    actuator, state : the actuator and one of its states.
    file : path of the file; its suffix selects the format.

    Raises
    ------
    ValueError
        If the suffix is neither ``.vtu`` nor ``.vtk``.
    """
    file = Path(file)
    if file.suffix not in (".vtu", ".vtk"):
        raise ValueError(f"file: got {file.name!r}, expected a name that ends in .vtu or .vtk")
    equations, thread = actuator.equations, actuator.equations.thread
    nodes, basis, units = equations.nodes, equations.basis, equations.units
    stations = np.linspace(0.0, basis.length, basis.spans + 1)

    def points(x: np.ndarray) -> np.ndarray:
        every = np.concatenate([x[:nodes], thread.points(x), basis.values(stations) @ x[nodes:]])
        return _MM * units.millimetre * every

    rest, moved = points(equations.rest_positions), points(state.deformation.positions)
    hexes = equations.mesh.cells[:, VTK_HEXAHEDRON]
    lines = [np.column_stack([line[:-1], line[1:]]) for line in thread.polylines]
    winding = nodes + np.concatenate([np.empty((0, 2), int), *lines])
    axis = len(rest) - len(stations) + np.column_stack([np.arange(basis.spans), np.arange(basis.spans) + 1])
    # The element pressure is positive in tension.
    mean = _KPA * units.megapascal * equations.halves.expand(state.deformation.element_pressure)[:, 0]
    pressure = np.repeat(-mean, equations.mesh.order**3)
    counts = (len(hexes), len(winding), len(axis))
    zeros = [np.zeros(count) for count in counts]
    grid = meshio.Mesh(
        moved,
        [("hexahedron", hexes), ("line", winding), ("line", axis)],
        point_data={"displacement_mm": moved - rest},
        cell_data={
            "part": [np.full(n, part) for n, part in zip(counts, (BODY, WINDING, ROD), strict=True)],
            "pressure_kpa": [pressure, zeros[1], zeros[2]],
            "tension_n": [
                zeros[0],
                units.newton * thread.tension(state.deformation.positions),
                units.newton * equations.axis.tension(state.deformation.positions[nodes:]),
            ],
        },
    )
    with atomic_part(file) as part:
        grid.write(part, file_format=file.suffix[1:])


class ActuatorSeries:
    """ParaView collection ``NAME.pvd`` of states ``NAME_0001.vtu`` ….

    The collection is complete after each state, so that an interrupted run can continue it.

    Parameters
    ----------
    file : path of the collection.

    Raises
    ------
    ValueError
        If the suffix is not ``.pvd``.
    """

    def __init__(self, file: str | Path) -> None:
        self._file = Path(file)
        if self._file.suffix != ".pvd":
            raise ValueError(f"file: got {self._file.name!r}, expected a name that ends in .pvd")
        self._pressures: dict[int, float] = {}

    def part(self, number: int) -> Path:
        """Return the file of a state."""
        return self._file.with_name(f"{self._file.stem}_{number:04d}.vtu")

    def keep(self, number: int, load: ActuatorLoad) -> None:
        """Add a state that an earlier process has written, if its file exists."""
        if self.part(number).exists():
            self._pressures[number] = max(load.pressure)

    def add(self, number: int, actuator: Actuator, state: ActuatorState) -> None:
        """Write a state and the collection; its time is the largest pressure in kPa."""
        write_actuator_vtk(actuator, state, self.part(number))
        self._pressures[number] = max(state.load.pressure)
        body = "\n".join(
            f'<DataSet timestep="{pressure / 1e3:g}" file="{self.part(k).name}"/>'
            for k, pressure in sorted(self._pressures.items())
        )
        write_atomically(
            self._file,
            f'<VTKFile type="Collection" version="0.1"><Collection>\n{body}\n</Collection></VTKFile>\n',
        )
