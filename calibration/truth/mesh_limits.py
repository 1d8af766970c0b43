"""What a run's angle and volumes would be in the limit of fine meshes, from the cell's refinement study.

The study (``python -m tests.benchmark.refinement``) bends the cell of each winding by one chamber and by two,
on nested meshes, and tells an interval of the limit. ``python -m tests.benchmark.refinement.mesh_table``
writes the ratio of the limit to the angle and to the torsional stiffness of each mesh, and the change of the
chambers' volumes, to the table that ships here.

A state with pressure in one chamber, or the same in two, has the ratio of that path at its pressure. Turns
and the mirror image of a helix reduce all chambers and pairs to chamber 1 and chambers 1 and 2 at another ψ.
Any other state has the interval that spans both paths, at its largest pressure. A winding that the study does
not know has the interval that spans all orientations of its layout, if three or more are known, or else all
windings. Its torsion is told by those of its layout and pitch alone, as it changes by a tenth with either.
"""

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

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
    volume_change : volumes in the middle of their intervals less those on the mesh, per length of the rod, of
        the path's first chamber and of those at 120° and 240° from it, at each pressure [m²].
    torsion : intervals of the ratio of the torsional stiffness in the limit to that on the mesh, of the
        states of this path for which they are known.
    """

    layout: Layout
    mesh: str
    path: str
    pressure: tuple[float, ...]
    least: tuple[float, ...]
    most: tuple[float, ...]
    volume_change: tuple[tuple[float, float, float], ...]
    torsion: tuple[tuple[float, float], ...]

    def at(self, pressure: float) -> tuple[float, float]:
        """Return the interval at a pressure, linear between those of the study and constant outside."""
        return (
            float(np.interp(pressure, self.pressure, self.least)),
            float(np.interp(pressure, self.pressure, self.most)),
        )

    def volumes_at(self, pressure: float) -> Float[np.ndarray, "3"]:
        """Return the change of the volumes at a pressure, likewise [m²]."""
        return np.array(
            [np.interp(pressure, self.pressure, of) for of in zip(*self.volume_change, strict=True)]
        )


@dataclass(frozen=True)
class Interval:
    """Interval of the ratio of an angle in the limit of fine meshes to that on a mesh.

    Parameters
    ----------
    least, most : ends of the interval.
    known : whether the study knows the winding, or the interval is that of others.
    volume_change : volumes in the limit less those on the mesh, per length of the rod [m²]; of several paths
        or windings their mean.
    """

    least: float
    most: float
    known: bool
    volume_change: Float[np.ndarray, "3"]

    @property
    def middle(self) -> float:
        """Middle of the interval."""
        return 0.5 * (self.least + self.most)

    @property
    def half_width(self) -> float:
        """Half of the interval."""
        return 0.5 * (self.most - self.least)


@dataclass(frozen=True)
class TorsionRatio:
    """Ratio of the torsional stiffness in the limit of fine meshes to that on a mesh.

    Parameters
    ----------
    ratio : mean over the states of the study.
    least, most : ends of the interval that spans those of all states.
    known : whether the study knows the winding, or these are others of its layout and pitch.
    """

    ratio: float
    least: float
    most: float
    known: bool


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
            return Interval(math.nan, math.nan, known=False, volume_change=np.full(3, math.nan))
        largest, known = float(max(pressure)), True
        found: list[tuple[MeshRatio, list[int]]] = []
        for path, chamber in _paths(pressure):
            of_path = [ratio for ratio in of_mesh if ratio.path == path]
            own = [(ratio, order) for ratio in of_path if (order := _order(ratio, layout, chamber))]
            known &= bool(own)
            others = [(ratio, _turned(chamber)) for ratio in _relatives(of_path, layout)]
            found += own[:1] or others
        ends = [ratio.at(largest) for ratio, _ in found]
        volumes = [ratio.volumes_at(largest)[np.argsort(order)] for ratio, order in found]
        return Interval(
            min(least for least, _ in ends), max(most for _, most in ends), known, np.mean(volumes, axis=0)
        )

    def torsion_ratio(self, layout: Layout, mesh: str) -> TorsionRatio | None:
        """Return the ratio of the torsional stiffness for a winding, or for all orientations (ψ None).

        Parameters
        ----------
        layout : winding.
        mesh : name of its mesh level.

        Returns
        -------
        ratio : None if the study knows no winding of that layout and pitch on that mesh.
        """
        alike = [ratio for ratio in self.ratios if ratio.mesh == mesh and _same_threads(ratio.layout, layout)]
        own = [ratio for ratio in alike if any(_order(ratio, layout, chamber) for chamber in range(3))]
        intervals = [interval for ratio in own or alike for interval in ratio.torsion]
        if not intervals:
            return None
        middles = [0.5 * (least + most) for least, most in intervals]
        least, most = min(low for low, _ in intervals), max(high for _, high in intervals)
        return TorsionRatio(float(np.mean(middles)), least, most, bool(own))


def _same_threads(first: Layout, second: Layout) -> bool:
    return first.name == second.name and abs(first.pitch - second.pitch) < _SAME


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


def _order(ratio: MeshRatio, layout: Layout, chamber: int) -> list[int] | None:
    """Return a state's chambers in the order of a path that is its own, turned or mirrored; or None.

    Parameters
    ----------
    ratio : path of the study.
    layout : winding of the state.
    chamber : its first chamber, 0 to 2: that of its path, or of the pair that begins with it.
    """
    own = ratio.layout
    if not _same_threads(own, layout):
        return None
    if layout.name == "ring":
        return _turned(chamber)
    if own.psi is None or layout.psi is None:
        return None
    # Seen from that chamber; half a turn is a shift along the rod, for six helices a sixth of a turn.
    psi = layout.psi - chamber * 2.0 * math.pi / 3.0
    turn = math.pi if layout.name == "double-helix" else math.pi / 3.0
    if abs(math.remainder(own.psi - psi, turn)) < _SAME:
        return _turned(chamber)
    # The mirror image of chamber 1 is at −ψ. That of chambers 1 and 2 is of 1 and 3, 240° further on.
    alone = ratio.path == ONE_CHAMBER
    if abs(math.remainder(own.psi + psi + (0.0 if alone else math.pi / 3.0), turn)) < _SAME:
        first, second, third = _turned(chamber)
        return [first, third, second] if alone else [second, first, third]
    return None


def _turned(chamber: int) -> list[int]:
    return [(chamber + k) % 3 for k in range(3)]


def _relatives(ratios: Sequence[MeshRatio], layout: Layout) -> Sequence[MeshRatio]:
    """Return the ratios of a layout's other orientations, if enough are known, or else of all windings."""
    same = [ratio for ratio in ratios if _same_threads(ratio.layout, layout)]
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
            "volume_change_m2": [list(row) for row in r.volume_change],
            "torsion": [list(interval) for interval in r.torsion],
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
                tuple(tuple(volumes) for volumes in row["volume_change_m2"]),
                tuple((least, most) for least, most in row["torsion"]),
            )
            for row in content["ratios"]
        )
    )
