"""What the angle of a run would be in the limit of fine meshes, from the refinement study of the cell.

The study (``python -m tests.benchmark.refinement``) bends the cell of each winding by one chamber and by two,
on nested meshes, and tells an interval of the limit. ``python -m tests.benchmark.refinement.mesh_table``
writes the ratio of the limit to the angle of each mesh to the table that ships here.

A state with pressure in one chamber, or the same in two, has the ratio of that path at its pressure. Turns
and the mirror image of a helix reduce all chambers and pairs to chamber 1 and chambers 1 and 2 at another ψ.
Any other state has the interval that spans both paths, at its largest pressure. A winding that the study does
not know has the interval that spans all orientations of its layout, if three or more are known, or else all
windings.
"""

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from rodmodel import Layout

#: Table that ships with the package.
SHIPPED_LIMITS = Path(__file__).with_name("mesh_limits.json")
ONE_CHAMBER, TWO_CHAMBERS = "one chamber", "two chambers"
SCHEMA = "rodmodel-mesh-limits"
# Largest difference between equal orientations [rad] and pitches [m], and between equal pressures, relative.
_SAME = 1e-6
# So many orientations of a layout tell about the others.
_ENOUGH = 3


@dataclass(frozen=True)
class MeshRatio:
    """Interval of the ratio of an angle in the limit of fine meshes to that on a mesh, along one path.

    Parameters
    ----------
    layout : winding.
    mesh : name of the mesh level.
    path : one chamber, or two.
    pressure : pressures, increasing [Pa].
    least, most : interval of the ratio at each pressure.
    """

    layout: Layout
    mesh: str
    path: str
    pressure: tuple[float, ...]
    least: tuple[float, ...]
    most: tuple[float, ...]

    def at(self, pressure: float) -> tuple[float, float]:
        """Return the interval at a pressure, linear between those of the study and constant outside."""
        return (
            float(np.interp(pressure, self.pressure, self.least)),
            float(np.interp(pressure, self.pressure, self.most)),
        )


@dataclass(frozen=True)
class Interval:
    """Interval of the ratio of an angle in the limit of fine meshes to that on a mesh.

    Parameters
    ----------
    least, most : ends of the interval.
    known : whether the study knows the winding, or the interval is that of others.
    """

    least: float
    most: float
    known: bool

    @property
    def middle(self) -> float:
        """Middle of the interval."""
        return 0.5 * (self.least + self.most)

    @property
    def half_width(self) -> float:
        """Half of the interval."""
        return 0.5 * (self.most - self.least)


@dataclass(frozen=True)
class MeshLimits:
    """Table of ratios."""

    ratios: tuple[MeshRatio, ...]

    def interval(self, layout: Layout, mesh: str, pressure: Sequence[float]) -> Interval:
        """Return the interval of the ratio for a state of the actuator.

        Parameters
        ----------
        layout : winding of the state.
        mesh : name of its mesh level.
        pressure : three pressures [Pa].

        Returns
        -------
        interval : NaN if the study has no winding on that mesh.
        """
        of_mesh = [ratio for ratio in self.ratios if ratio.mesh == mesh]
        if not of_mesh:
            return Interval(math.nan, math.nan, known=False)
        largest, known = float(max(pressure)), True
        found: list[tuple[float, float]] = []
        for path, chamber in _paths(pressure):
            of_path = [ratio for ratio in of_mesh if ratio.path == path]
            own = [ratio for ratio in of_path if _is_alike(ratio, layout, chamber)]
            known &= bool(own)
            found += [ratio.at(largest) for ratio in own[:1] or _relatives(of_path, layout)]
        return Interval(min(least for least, _ in found), max(most for _, most in found), known)


def _paths(pressure: Sequence[float]) -> list[tuple[str, int]]:
    """Return the paths that a state lies on or between, each with its first chamber, 0 to 2."""
    p = np.asarray(pressure, float)
    first = int(np.argmax(p))
    # Of the pair k, k + 1 the first chamber is k: the third one is k + 2.
    pair = (int(np.argmin(p)) + 1) % 3
    second, third = np.sort(p)[1::-1]
    slack = _SAME * p.max()
    if p.max() > 0.0 and second <= slack:
        return [(ONE_CHAMBER, first)]
    if third <= slack and p.max() - second <= slack and p.max() > 0.0:
        return [(TWO_CHAMBERS, pair)]
    return [(ONE_CHAMBER, first), (TWO_CHAMBERS, pair)]


def _is_alike(ratio: MeshRatio, layout: Layout, chamber: int) -> bool:
    """Return whether a path is that of a winding's chamber, or of the pair that begins with it."""
    own = ratio.layout
    if own.name != layout.name or abs(own.pitch - layout.pitch) > _SAME:
        return False
    if layout.name == "ring":
        return True
    if own.psi is None or layout.psi is None:
        return False
    # Seen from that chamber; half a turn is a shift along the rod, for six helices a sixth of a turn.
    psi = layout.psi - chamber * 2.0 * math.pi / 3.0
    turn = math.pi if layout.name == "double-helix" else math.pi / 3.0
    # The mirror image of chamber 1 is at −ψ. That of chambers 1 and 2 is of 1 and 3, 240° further on.
    mirrored = -psi if ratio.path == ONE_CHAMBER else -psi - math.pi / 3.0
    return any(abs(math.remainder(own.psi - one, turn)) < _SAME for one in (psi, mirrored))


def _relatives(ratios: Sequence[MeshRatio], layout: Layout) -> Sequence[MeshRatio]:
    """Return the ratios of a layout's other orientations, if enough are known, or else of all windings."""
    same = [r for r in ratios if r.layout.name == layout.name and abs(r.layout.pitch - layout.pitch) < _SAME]
    return same if len({r.layout.psi for r in same}) >= _ENOUGH else ratios


def save_limits(ratios: Iterable[MeshRatio], provenance: dict[str, Any], file: Path) -> None:
    """Write a table atomically."""
    from rodmodel.io import write_atomically

    rows = [
        {
            "winding": {"name": r.layout.name, "psi_rad": r.layout.psi, "pitch_m": r.layout.pitch},
            "mesh": r.mesh,
            "path": r.path,
            "pressure_pa": list(r.pressure),
            "least": list(r.least),
            "most": list(r.most),
        }
        for r in ratios
    ]
    lines = ",\n".join(json.dumps(row) for row in rows)
    head = json.dumps({"schema": SCHEMA, "version": 1, "provenance": provenance})[:-1]
    write_atomically(file, f'{head},\n "ratios": [\n{lines}\n]}}\n')


@cache
def load_limits(file: Path = SHIPPED_LIMITS) -> MeshLimits:
    """Read a table that `save_limits` wrote."""
    content = json.loads(file.read_text())
    if content.get("schema") != SCHEMA or content.get("version") != 1:
        raise ValueError(f"{file}: got {content.get('schema')!r}, expected {SCHEMA!r}, version 1")
    return MeshLimits(
        tuple(
            MeshRatio(
                Layout(row["winding"]["name"], row["winding"]["psi_rad"], row["winding"]["pitch_m"]),
                row["mesh"],
                row["path"],
                tuple(row["pressure_pa"]),
                tuple(row["least"]),
                tuple(row["most"]),
            )
            for row in content["ratios"]
        )
    )
