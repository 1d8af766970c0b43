"""Structured hexahedral mesh of the actuator's body, made by gmsh and handed to scikit-fem.

The section is cut into 21 four-sided blocks (inner wall, partitions, and the outer wall in two layers that
meet on the winding's cylinder), each meshed transfinitely and extruded along z. Lengths in this file are
millimetres.
"""

import math
from dataclasses import dataclass

import gmsh
import numpy as np
import skfem

from fem_reference.geometry import ActuatorGeometry

MILLIMETRE = 1e3
CAVITY, OUTER, BOTTOM, TOP = "cavity", "outer", "bottom", "top"
CHAMBERS = ("chamber1", "chamber2", "chamber3")


@dataclass(frozen=True)
class MeshLevel:
    """Numbers of elements of the section's blocks, and the element length along z.

    Parameters
    ----------
    inner_arc, outer_arc : along a chamber's inner and outer arc.
    partition_across, partition_along : across a partition's thickness and along its length.
    inner_wall, outer_wall_inside, outer_wall_outside : through the walls (the outer one inside and outside
        the
        winding's cylinder).
    axial_size : target length of an element along z [mm].
    """

    inner_arc: int
    outer_arc: int
    partition_across: int
    partition_along: int
    inner_wall: int
    outer_wall_inside: int
    outer_wall_outside: int
    axial_size: float

    @property
    def around(self) -> int:
        """Elements around the outer circumference."""
        return 3 * (self.outer_arc + self.partition_across)


LEVELS = {
    "coarse": MeshLevel(4, 12, 4, 4, 2, 2, 1, 0.5),
    "medium": MeshLevel(6, 16, 4, 5, 3, 2, 1, 0.43),
    # About 0.4 mm everywhere, as in the paper.
    "paper": MeshLevel(8, 24, 4, 6, 4, 2, 1, 0.375),
}


def mesh_level(name: str) -> MeshLevel:
    """Return the mesh level of that name, or raise a ValueError that lists them."""
    if name not in LEVELS:
        raise ValueError(f"elements: got {name!r}, expected one of {', '.join(LEVELS)}")
    return LEVELS[name]


def body_mesh(geometry: ActuatorGeometry, length: float, level: MeshLevel) -> skfem.MeshHex:
    """Mesh the body between z = 0 and z = ``length`` with hexahedra only.

    Parameters
    ----------
    geometry : dimensions of the actuator.
    length : axial length [m].
    level : element counts.

    Returns
    -------
    mesh : in mm, with the boundaries ``cavity``, ``outer``, ``bottom``, ``top`` and ``chamber1`` …
        ``chamber3``.
        Nodes of the top face lie straight above those of the bottom face.
    """
    layers = max(2, round(length * MILLIMETRE / level.axial_size))
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("body")
        surfaces = _section(geometry, level)
        lateral = _extrude(surfaces, length * MILLIMETRE, layers)
        gmsh.model.mesh.generate(3)
        return _to_skfem(lateral)
    finally:
        gmsh.finalize()


def _section(geometry: ActuatorGeometry, level: MeshLevel) -> list[tuple[int, list[str | None]]]:
    """Build the 21 blocks; return each surface with the boundary name of its four curves (None inside)."""
    geo = gmsh.model.geo
    radii = [
        geometry.cavity_diameter / 2.0,
        geometry.chamber_inner_radius,
        geometry.chamber_outer_radius,
        geometry.winding_diameter / 2.0,
        geometry.body_diameter / 2.0,
    ]
    radii = [r * MILLIMETRE for r in radii]
    half_inner = geometry.chamber_half_angle(geometry.chamber_inner_radius)
    half_outer = geometry.chamber_half_angle(geometry.chamber_outer_radius)
    half_angles = [half_inner, half_inner, half_outer, half_outer, half_outer]
    centre = geo.addPoint(0.0, 0.0, 0.0)

    # Corner (ring, k, side): on ring's radius, at the edge of chamber k; side 0 before its centre, 1 after.
    corner = {}
    for ring, (radius, half) in enumerate(zip(radii, half_angles, strict=True)):
        for k in range(3):
            for side, sign in enumerate((-1.0, 1.0)):
                azimuth = 2.0 * math.pi / 3.0 * k + sign * half
                corner[ring, k, side] = geo.addPoint(
                    radius * math.cos(azimuth), radius * math.sin(azimuth), 0.0
                )

    def arcs(ring: int, chamber: int, partition: int) -> list[int]:
        """Arcs around one ring in order: chamber 1, partition 1–2, chamber 2 and so on."""
        curves = []
        for k in range(3):
            for start, end, count in (
                (corner[ring, k, 0], corner[ring, k, 1], chamber),
                (corner[ring, k, 1], corner[ring, (k + 1) % 3, 0], partition),
            ):
                curve = geo.addCircleArc(start, centre, end)
                geo.mesh.setTransfiniteCurve(curve, count + 1)
                curves.append(curve)
        return curves

    def spokes(ring: int, count: int) -> list[int]:
        """Straight lines from ring to ring + 1, at the start of each arc of ``arcs``."""
        curves = []
        for k in range(3):
            for side in (0, 1):
                curve = geo.addLine(corner[ring, k, side], corner[ring + 1, k, side])
                geo.mesh.setTransfiniteCurve(curve, count + 1)
                curves.append(curve)
        return curves

    ring_arcs = [
        arcs(ring, level.inner_arc if ring < 2 else level.outer_arc, level.partition_across)
        for ring in range(5)
    ]
    ring_spokes = [
        spokes(0, level.inner_wall),
        spokes(1, level.partition_along),
        spokes(2, level.outer_wall_inside),
        spokes(3, level.outer_wall_outside),
    ]
    surfaces = []
    for ring in range(4):
        for i in range(6):
            chamber = i % 2 == 0
            if ring == 1 and chamber:
                continue
            here, there = ring_spokes[ring][i], ring_spokes[ring][(i + 1) % 6]
            inner, outer = ring_arcs[ring][i], ring_arcs[ring + 1][i]
            surface = geo.addPlaneSurface([geo.addCurveLoop([inner, there, -outer, -here])])
            geo.mesh.setTransfiniteSurface(surface)
            geo.mesh.setRecombine(2, surface)
            names: list[str | None] = [None] * 4
            if ring == 0:
                names[0] = CAVITY
                names[2] = CHAMBERS[i // 2] if chamber else None
            elif ring == 1:
                # A partition's first side faces the chamber after it in the order of the arcs.
                names[1], names[3] = CHAMBERS[(i // 2 + 1) % 3], CHAMBERS[i // 2]
            elif ring == 2:
                names[0] = CHAMBERS[i // 2] if chamber else None
            else:
                names[2] = OUTER
            surfaces.append((surface, names))
    return surfaces


def _extrude(
    surfaces: list[tuple[int, list[str | None]]], length: float, layers: int
) -> dict[str, list[int]]:
    """Extrude every block; return the tags of the surfaces of each named boundary."""
    named: dict[str, list[int]] = {name: [] for name in (CAVITY, OUTER, BOTTOM, TOP, *CHAMBERS)}
    volumes = []
    for surface, names in surfaces:
        out = gmsh.model.geo.extrude([(2, surface)], 0.0, 0.0, length, numElements=[layers], recombine=True)
        named[BOTTOM].append(surface)
        named[TOP].append(out[0][1])
        volumes.append(out[1][1])
        for name, (_, tag) in zip(names, out[2:], strict=True):
            if name is not None:
                named[name].append(tag)
    gmsh.model.geo.synchronize()
    gmsh.model.addPhysicalGroup(3, volumes, name="body")
    return named


def _to_skfem(named: dict[str, list[int]]) -> skfem.MeshHex:
    """Read nodes, hexahedra and boundary quadrilaterals from gmsh into a scikit-fem mesh."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    types, _, nodes = gmsh.model.mesh.getElements(dim=3)
    if list(types) != [5]:
        raise RuntimeError(f"gmsh made element types {list(types)}; expected 8-node hexahedra (5) only")
    used, hexes = np.unique(nodes[0], return_inverse=True)
    where = np.full(int(max(tags)) + 1, -1)
    where[used.astype(int)] = np.arange(used.size)
    points = np.empty((used.size, 3))
    keep = where[tags.astype(int)] >= 0
    points[where[tags.astype(int)[keep]]] = coordinates.reshape(-1, 3)[keep]
    hexes = hexes.reshape(-1, 8)
    # gmsh counts a hexahedron's nodes around its bottom and then its top face; scikit-fem in binary order.
    mesh = skfem.MeshHex(np.ascontiguousarray(points.T), np.ascontiguousarray(_binary_order(hexes).T))

    sorted_facets = {tuple(sorted(f)): i for i, f in enumerate(mesh.facets.T)}
    boundaries = {}
    for name, surfaces in named.items():
        quads = [gmsh.model.mesh.getElementsByType(3, tag)[1].reshape(-1, 4) for tag in surfaces]
        corner = where[np.vstack(quads).astype(int)]
        boundaries[name] = np.unique([sorted_facets[tuple(sorted(q))] for q in corner])
    return mesh.with_boundaries(boundaries)


def _binary_order(hexes: np.ndarray) -> np.ndarray:
    """Reorder 8-node hexahedra from gmsh's to scikit-fem's convention."""
    # scikit-fem's reference nodes, in order; gmsh's: (0,0,0),(1,0,0),(1,1,0),(0,1,0) and the same at z = 1.
    gmsh_nodes = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    order = [gmsh_nodes.index((int(x), int(y), int(z))) for x, y, z in skfem.ElementHex1.doflocs]
    return hexes[:, np.array(order)]
