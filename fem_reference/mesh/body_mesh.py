"""Hexahedral mesh of the body: the cross-section extruded along z, for one period or with the cap.

Lengths are in the millimetres of given `Units`.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import skfem
from jaxtyping import Float, Int

from fem_reference.geometry import SI, ActuatorGeometry, Units
from fem_reference.mesh.cross_section import CHAMBERS, MeshLevel, Section, mesh_section
from fem_reference.mesh.hexahedron import reference_element

BOTTOM, TOP = "bottom", "top"

# Round-off of a number of layers.
_ROUND_OFF = 1e-9

#: Nodes of a hexahedron in tensor order, as VTK counts them.
VTK_HEXAHEDRON = [0, 1, 3, 2, 4, 5, 7, 6]


@dataclass(frozen=True)
class BodyMesh:
    """Linear or quadratic hexahedra with their nodes in tensor order (see `reference_element`).

    Parameters
    ----------
    points : positions of the nodes [mm].
    elements : (order + 1)³ nodes of each element.
    facets : by boundary, the (order + 1)² nodes of each facet, in tensor order.
    """

    points: Float[np.ndarray, "nodes 3"]
    elements: Int[np.ndarray, "elements _"]
    facets: dict[str, Int[np.ndarray, "_ _"]]

    @property
    def order(self) -> int:
        """Order of the elements' polynomials."""
        return 1 if self.elements.shape[1] == 8 else 2

    def nodes(self, boundary: str) -> Int[np.ndarray, " nodes"]:
        """Nodes on a boundary."""
        return np.unique(self.facets[boundary])

    def quads(self, boundary: str) -> Int[np.ndarray, "facets 4"]:
        """Facets of a boundary as cycles of four nodes; each quadratic facet is cut into four."""
        return cut(self.facets[boundary], self.order)

    def oriented(self, boundary: str) -> Int[np.ndarray, "facets _"]:
        """Facets of a boundary, oriented so that their normals ∂x/∂ξ × ∂x/∂η point into the elements."""
        wanted = np.zeros(len(self.points), dtype=bool)
        wanted[self.facets[boundary]] = True
        side = self.order + 1
        grid = self.elements.reshape(-1, side, side, side)
        # Faces x = 0, 1; y = 0, 1; z = 0, 1, each as (η, ξ) with its normal inwards.
        faces = [grid[:, :, :, 0], _swapped(grid[:, :, :, -1]), _swapped(grid[:, :, 0]), grid[:, :, -1]]
        faces += [grid[:, 0], _swapped(grid[:, -1])]
        own = np.concatenate([face.reshape(-1, side**2) for face in faces])
        own = own[wanted[own].all(axis=1)]
        named = {tuple(key): face for key, face in zip(np.sort(own, axis=1).tolist(), own, strict=True)}
        keys = np.sort(self.facets[boundary], axis=1).tolist()
        return np.array([named[tuple(key)] for key in keys])

    @cached_property
    def cells(self) -> Int[np.ndarray, "cells 8"]:
        """Linear hexahedra on the same nodes, in tensor order; each quadratic element is cut into eight."""
        side = self.order + 1
        grid = self.elements.reshape(-1, side, side, side)
        corners = [
            grid[:, k : side - 1 + k, j : side - 1 + j, i : side - 1 + i]
            for k in (0, 1)
            for j in (0, 1)
            for i in (0, 1)
        ]
        return np.stack(corners, axis=-1).reshape(-1, 8)

    def linear(self) -> skfem.MeshHex:
        """`cells` as a mesh of scikit-fem."""
        grid = np.rint(skfem.ElementHex1.doflocs).astype(int)
        return skfem.MeshHex(
            np.ascontiguousarray(self.points.T), np.ascontiguousarray(self.cells.T[grid @ [1, 2, 4]])
        )

    def nodal_areas(self, boundary: str) -> Float[np.ndarray, " nodes"]:
        """Area of a boundary that belongs to each node [mm²]: the integral of its shape function.

        On flat facets these areas have the boundary's total area and centroid exactly.
        """
        facets = self.facets[boundary]
        values, areas = self.gauss_points(boundary)
        shares = areas @ values
        return np.bincount(facets.ravel(), weights=shares.ravel(), minlength=len(self.points))

    def gauss_points(
        self, boundary: str
    ) -> tuple[Float[np.ndarray, "gauss own"], Float[np.ndarray, "facets gauss"]]:
        """Shape functions of a facet at its Gauss points, and the area of each Gauss point [mm²]."""
        facets = self.facets[boundary]
        point, weight = np.polynomial.legendre.leggauss(self.order + 1)
        across, along = np.meshgrid(0.5 + 0.5 * point, 0.5 + 0.5 * point, indexing="ij")
        # On its face ζ = 0 an element has the shape functions of a facet: those of its first nodes.
        local = np.column_stack([along.ravel(), across.ravel(), np.zeros(along.size)])
        values, slopes = reference_element(self.order).evaluate(local)
        own = facets.shape[1]
        tangents = np.einsum("qaj,fai->jfqi", slopes[:, :own, :2], self.points[facets])
        areas = np.linalg.norm(np.cross(*tangents), axis=-1) * np.outer(weight, weight).ravel() / 4.0
        return values[:, :own], areas


def body_mesh(
    geometry: ActuatorGeometry,
    length: float,
    level: MeshLevel,
    interval: float | None = None,
    units: Units = SI,
) -> BodyMesh:
    """Mesh the body between z = 0 and z = ``length`` with hexahedra only.

    Parameters
    ----------
    geometry : dimensions of the actuator.
    length : axial length [m].
    level : element counts.
    interval : axial distance between crossings of threads, or rings [m]; the length is a multiple of it.
        Every interval gets the same number of layers, two at least, and the length an even number.
    units : of the mesh.

    Returns
    -------
    mesh : in mm, with the boundaries ``cavity``, ``outer``, ``bottom``, ``top`` and ``chamber1`` …
        ``chamber3``. Nodes of the top face lie straight above those of the bottom face.
    """
    section = mesh_section(geometry, level, units=units)
    end = length * units.metre
    layers = _layers(end, level) if interval is None else _regular_layers(end, interval * units.metre, level)
    return _extrude(section, _grid(0.0, end, layers, level.order), np.empty(0), level.order)


def actuator_mesh(geometry: ActuatorGeometry, level: MeshLevel, units: Units = SI) -> BodyMesh:
    """Mesh the body with its cap.

    Parameters
    ----------
    geometry : dimensions of the actuator.
    level : element counts; even along the chambers' sides.
    units : of the mesh.

    Returns
    -------
    mesh : in mm, with the boundaries of `body_mesh`. Those of the chambers include the ceilings, where the
        cap begins; the cavity runs through the cap.
    """
    body = geometry.body_length * units.metre
    end = body + geometry.cap_length * units.metre
    section = mesh_section(geometry, level, filled=True, units=units)
    below = _grid(0.0, body, _layers(body, level), level.order)
    above = _grid(body, end, _layers(end - body, level), level.order)
    return _extrude(section, below, above[1:], level.order)


def _layers(length: float, level: MeshLevel) -> int:
    return max(2, round(length / level.axial_size))


def _regular_layers(length: float, interval: float, level: MeshLevel) -> int:
    """Layers of a length with the same number in every interval.

    A crossing between two layers holds the body otherwise than one within a layer, and threads that cross
    within one layer cannot move past each other.
    """
    intervals = round(length / interval)
    own = max(2, math.ceil(interval / level.axial_size - _ROUND_OFF))
    return intervals * (own + own % 2 if intervals % 2 else own)


def _grid(start: float, end: float, layers: int, order: int) -> Float[np.ndarray, " levels"]:
    return np.linspace(start, end, layers * order + 1)


def _extrude(
    section: Section, body: Float[np.ndarray, " levels"], cap: Float[np.ndarray, " above"], order: int
) -> BodyMesh:
    """Extrude a section into layers of hexahedra; above the body, the cap fills the chambers too."""
    levels = np.concatenate([body, cap])
    per_level = len(section.points)
    ceiling = len(body) - 1

    def layers(flat: np.ndarray, first: int, last: int) -> np.ndarray:
        """Extrude quadrilaterals into elements, or edges into facets, between two levels."""
        below = flat[None] + per_level * np.arange(first, last, order)[:, None, None]
        stack = [below + per_level * k for k in range(order + 1)]
        return np.concatenate(stack, axis=2).reshape(-1, (order + 1) * flat.shape[1])

    top = len(levels) - 1
    hexes = [layers(section.quads, 0, top)]
    named = {BOTTOM: [section.quads], TOP: [section.quads]}
    for name, edges in section.edges.items():
        named[name] = [layers(edges, 0, ceiling if name in CHAMBERS else top)]
    if cap.size:
        hexes += [layers(quads, ceiling, top) for quads in section.filling]
        named[TOP] += list(section.filling)
        for name, quads in zip(CHAMBERS, section.filling, strict=True):
            named[name].append(quads + per_level * ceiling)
    named[TOP] = [quads + per_level * top for quads in named[TOP]]

    elements = np.concatenate(hexes)
    used, nodes = np.unique(elements, return_inverse=True)
    where = np.full(per_level * len(levels), -1)
    where[used] = np.arange(used.size)
    points = np.column_stack([np.tile(section.points, (len(levels), 1)), np.repeat(levels, per_level)])[used]
    facets = {name: where[np.vstack(parts)] for name, parts in named.items()}
    return BodyMesh(points, nodes.reshape(elements.shape), facets)


def _swapped(faces: Int[np.ndarray, "n side side"]) -> Int[np.ndarray, "n side side"]:
    return np.swapaxes(faces, 1, 2)


def cut(facets: Int[np.ndarray, "facets _"], order: int) -> Int[np.ndarray, "quads 4"]:
    """Cut facets, whose nodes are in tensor order, into cycles of four nodes."""
    grid = facets.reshape(-1, order + 1, order + 1)
    low, high = slice(None, -1), slice(1, None)
    cycle = [grid[:, low, low], grid[:, low, high], grid[:, high, high], grid[:, high, low]]
    return np.stack(cycle, axis=-1).reshape(-1, 4)
