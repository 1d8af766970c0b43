"""Quadrilateral mesh of the actuator's cross-section, by gmsh.

The silicone of the section is cut into 21 four-sided blocks (inner wall, partitions, and the outer wall in
two layers that meet on the winding's cylinder), each meshed transfinitely. For the cap the three chambers are
filled with unstructured quadrilaterals. Lengths are in the millimetres of given `Units`.
"""

import itertools
import math
from dataclasses import dataclass

import gmsh
import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from fem_reference.geometry import SI, ActuatorGeometry, Units, refuse_implausible

CAVITY, OUTER = "cavity", "outer"
CHAMBERS = ("chamber1", "chamber2", "chamber3")


@dataclass(frozen=True)
class MeshLevel:
    """Element counts of the section's blocks, and the element length along z.

    Parameters
    ----------
    inner_arc, outer_arc : elements along a chamber's inner and outer arc.
    partition_across, partition_along : elements across a partition's thickness and along its length.
    inner_wall, outer_wall_inside, outer_wall_outside : elements through the walls; the outer wall counts
        those inside and outside the winding's cylinder.
    axial_size : length of an element along z in a body of 12 mm [mm]: about that in an actuator, and at most
        that in a cell. In other bodies it is the same share of the diameter.
    order : 1 for linear elements with mean dilatation, as in the paper; 2 for quadratic elements with
        linear discontinuous pressure.
    """

    inner_arc: int
    outer_arc: int
    partition_across: int
    partition_along: int
    inner_wall: int
    outer_wall_inside: int
    outer_wall_outside: int
    axial_size: float
    order: int = 1

    def __post_init__(self) -> None:
        refuse_implausible("axial_size", self.axial_size)

    @property
    def around(self) -> int:
        """Number of node intervals around the outer circumference."""
        return 3 * (self.outer_arc + self.partition_across) * self.order


LEVELS = {
    "coarse": MeshLevel(4, 12, 4, 4, 2, 2, 1, 0.5),
    # The same section with half the element length: for a whole actuator of any winding.
    "layered": MeshLevel(4, 12, 4, 4, 2, 2, 1, 0.25),
    "medium": MeshLevel(6, 18, 4, 6, 3, 2, 1, 0.375),
    # About 0.4 mm everywhere, as in the paper.
    "paper": MeshLevel(8, 24, 4, 6, 4, 2, 1, 0.375),
    "quadratic": MeshLevel(2, 8, 2, 2, 1, 1, 1, 0.75, order=2),
    # Near the limit in free bending: helices on the first, rings on the second (`converged_level`).
    "fine": MeshLevel(2, 12, 2, 4, 1, 1, 1, 0.75, order=2),
    "finer": MeshLevel(4, 12, 2, 4, 1, 2, 1, 0.75, order=2),
}


def mesh_level(name: str | MeshLevel) -> MeshLevel:
    """Return the mesh level of that name, or raise a ValueError that lists them; a level is its own."""
    if isinstance(name, MeshLevel):
        return name
    if name not in LEVELS:
        raise ValueError(f"elements: got {name!r}, expected one of {', '.join(LEVELS)}")
    return LEVELS[name]


@dataclass(frozen=True)
class Section:
    """Quadrilaterals of the cross-section [mm], with (order + 1)² nodes in tensor order.

    Parameters
    ----------
    points : positions of the nodes.
    quads : quadrilaterals of the silicone, counter-clockwise.
    filling : quadrilaterals in each chamber; empty arrays unless the chambers are filled.
    edges : by boundary (``cavity``, ``outer``, ``chamber1`` … ``chamber3``), the order + 1 nodes of each
        edge from end to end.
    """

    points: Float[np.ndarray, "nodes 2"]
    quads: Int[np.ndarray, "quads _"]
    filling: tuple[Int[np.ndarray, "_ _"], ...]
    edges: dict[str, Int[np.ndarray, "_ _"]]


def mesh_section(
    geometry: ActuatorGeometry, level: MeshLevel, filled: bool = False, units: Units = SI
) -> Section:
    """Mesh the cross-section.

    Parameters
    ----------
    geometry : dimensions of the actuator.
    level : element counts.
    filled : mesh the chambers too.
    units : of the mesh.

    Raises
    ------
    ValueError
        If chambers are to be filled and a count along their sides is odd, which no quadrilaterals can fill,
        or gmsh finds no mesh of quadrilaterals for the counts.
    """
    for name in ("inner_arc", "outer_arc", "partition_along"):
        if filled and getattr(level, name) % 2:
            raise ValueError(
                f"{name}: got {getattr(level, name)} elements, expected an even number under a cap"
            )
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("section")
        surfaces, curves = _blocks(geometry, level, units)
        _generate(level)
        section = _read(surfaces, curves, level.order)
        return _filled(section, geometry, level, units) if filled else section
    finally:
        gmsh.finalize()


def _generate(level: MeshLevel) -> None:
    gmsh.model.geo.synchronize()
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(level.order)


def _blocks(
    geometry: ActuatorGeometry, level: MeshLevel, units: Units
) -> tuple[list[int], dict[str, list[int]]]:
    """Build the blocks; return the surfaces of the silicone and the curves of each boundary."""
    geo = gmsh.model.geo
    inner, rest = geometry.chamber_inner_radius, geometry.chamber_outer_radius
    # For each ring: its radius at each chamber, and the radius at which the partitions' sides cut it.
    rings = [
        ((geometry.cavity_diameter / 2.0,) * 3, (inner,) * 3),
        ((inner,) * 3, (inner,) * 3),
        (geometry.chamber_outer_radii, geometry.chamber_outer_radii),
        ((geometry.winding_diameter / 2.0,) * 3, (rest,) * 3),
        ((geometry.body_diameter / 2.0,) * 3, (rest,) * 3),
    ]
    centre = geo.addPoint(0.0, 0.0, 0.0)

    # Corner (ring, k, side): on ring's radius, at the edge of chamber k; side 0 before its centre, 1 after.
    corner = {}
    for ring, (radii, cuts) in enumerate(rings):
        for k, (radius, cut) in enumerate(zip(radii, cuts, strict=True)):
            half = geometry.chamber_half_angle(cut)
            for side, sign in enumerate((-1.0, 1.0)):
                azimuth = 2.0 * math.pi / 3.0 * k + sign * half
                x, y = (radius * units.metre * part for part in (math.cos(azimuth), math.sin(azimuth)))
                corner[ring, k, side] = geo.addPoint(x, y, 0.0)

    def arcs(ring: int, chamber: int, partition: int) -> list[int]:
        """Arcs around one ring in order: chamber 1, partition 1–2, chamber 2 and so on.

        A straight line joins chambers of different radii.
        """
        curves = []
        radii = rings[ring][0]
        for k in range(3):
            after = (k + 1) % 3
            for start, end, count, round_ in (
                (corner[ring, k, 0], corner[ring, k, 1], chamber, True),
                (corner[ring, k, 1], corner[ring, after, 0], partition, radii[k] == radii[after]),
            ):
                curve = geo.addCircleArc(start, centre, end) if round_ else geo.addLine(start, end)
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
            if ring == 1 and i % 2 == 0:
                continue
            surfaces.append(_block(ring_arcs, ring_spokes, ring, i))
            geo.mesh.setTransfiniteSurface(surfaces[-1])
    curves = {CAVITY: ring_arcs[0], OUTER: ring_arcs[4]}
    for k, name in enumerate(CHAMBERS):
        sides = ring_spokes[1][2 * k : 2 * k + 2]
        curves[name] = [ring_arcs[1][2 * k], ring_arcs[2][2 * k], *sides]
    return surfaces, curves


def _block(arcs: list[list[int]], spokes: list[list[int]], ring: int, i: int) -> int:
    """Surface between two rings and two spokes, to be meshed with quadrilaterals."""
    geo = gmsh.model.geo
    loop = [arcs[ring][i], spokes[ring][(i + 1) % 6], -arcs[ring + 1][i], -spokes[ring][i]]
    surface: int = geo.addPlaneSurface([geo.addCurveLoop(loop)])
    geo.mesh.setRecombine(2, surface)
    return surface


# By order: gmsh's types of quadrilaterals and of lines, and their nodes in tensor order.
_QUAD, _LINE = {1: 3, 2: 10}, {1: 1, 2: 8}
_QUAD_NODES = {1: [0, 1, 3, 2], 2: [0, 4, 1, 7, 8, 5, 3, 6, 2]}
_LINE_NODES = {1: [0, 1], 2: [0, 2, 1]}
# gmsh's ways to make quadrilaterals, of which the first wants even counts; and the triangles before them.
_FULL_QUAD, _BLOSSOM = 2, 1
_ALGORITHMS = (6, 5, 1)
# Distance below which nodes of two meshes are one [mm].
_SAME = 1e-6


def _read(surfaces: list[int], curves: dict[str, list[int]], order: int) -> Section:
    """Take nodes, quadrilaterals and boundary edges over from gmsh; chambers are not filled yet."""
    types, *_ = gmsh.model.mesh.getElements(dim=2)
    if list(types) != [_QUAD[order]]:
        raise RuntimeError(f"gmsh made element types {list(types)}; expected quadrilaterals only")
    quads = _elements(_QUAD[order], _QUAD_NODES[order], surfaces)
    used = np.unique(quads)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    where = np.full(int(tags.max()) + 1, -1)
    where[used] = np.arange(used.size)
    points = np.empty((used.size, 2))
    keep = where[tags.astype(int)] >= 0
    points[where[tags.astype(int)[keep]]] = coordinates.reshape(-1, 3)[keep, :2]
    edges = {name: where[_elements(_LINE[order], _LINE_NODES[order], tags)] for name, tags in curves.items()}
    empty = np.empty((0, quads.shape[1]), int)
    return Section(points, _counter_clockwise(where[quads], points, order), (empty,) * 3, edges)


def _filled(section: Section, geometry: ActuatorGeometry, level: MeshLevel, units: Units) -> Section:
    """The section with its chambers filled, each alike on both sides of its middle and as the others.

    Quadrilaterals without structure, as the arcs inside and outside differ in their counts. gmsh makes half a
    chamber of each size; the rest are its images, so that the mesh has the planes of symmetry that the body
    has.
    """
    halves = {
        radius: _half_chamber(geometry, radius, level, units) for radius in set(geometry.chamber_outer_radii)
    }
    points, filling = section.points, []
    for k, radius in enumerate(geometry.chamber_outer_radii):
        half, quads = halves[radius]
        azimuth = 2.0 * math.pi / 3.0 * k
        turn = np.array([[math.cos(azimuth), -math.sin(azimuth)], [math.sin(azimuth), math.cos(azimuth)]])
        images = [half @ turn.T, half * [1.0, -1.0] @ turn.T]
        parts = []
        for image in images:
            distance, nearest = cKDTree(points).query(image)
            new = distance > _SAME
            where = np.where(new, len(points) - 1 + np.cumsum(new), nearest)
            points = np.vstack([points, image[new]])
            parts.append(where[quads])
        filling.append(_counter_clockwise(np.concatenate(parts), points, level.order))
    return Section(points, section.quads, tuple(filling), section.edges)


def _half_chamber(
    geometry: ActuatorGeometry, radius: float, level: MeshLevel, units: Units
) -> tuple[Float[np.ndarray, "nodes 2"], Int[np.ndarray, "quads _"]]:
    """Mesh the half y ≥ 0 of a chamber at azimuth 0, with the silicone's edges along its sides.

    Each algorithm of gmsh leaves triangles or splits edges at some counts, so several are tried.
    """
    sides = level.inner_arc // 2, level.partition_along, level.outer_arc // 2
    # Quadrilaterals fill what has an even number of edges.
    even = level.partition_along + sum(sides) % 2
    for middle, recombination, algorithm in itertools.product(
        (even, even + 2, max(1, even - 2), even + 4), (_FULL_QUAD, _BLOSSOM), _ALGORITHMS
    ):
        if recombination == _FULL_QUAD and any(count % 2 for count in (*sides, middle)):
            continue
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", recombination)
        gmsh.option.setNumber("Mesh.Algorithm", algorithm)
        counts = (*sides, middle)
        curves = _half_block(geometry, radius, counts, units)
        _generate(level)
        edges = [len(_elements(_LINE[level.order], _LINE_NODES[level.order], [curve])) for curve in curves]
        if edges == list(counts) and list(gmsh.model.mesh.getElements(dim=2)[0]) == [_QUAD[level.order]]:
            half = _read([entity for _, entity in gmsh.model.getEntities(2)], {}, level.order)
            return half.points, half.quads
    raise ValueError(
        f"elements: got {sides} along the sides of half a chamber, which gmsh cannot fill with "
        "quadrilaterals; expected others"
    )


def _half_block(
    geometry: ActuatorGeometry, radius: float, counts: tuple[int, int, int, int], units: Units
) -> list[int]:
    """Build half a chamber as a model of its own; return its inner, side, outer and middle curves.

    ``counts`` are their numbers of edges.
    """
    gmsh.model.add("half chamber")
    geo, inner = gmsh.model.geo, geometry.chamber_inner_radius
    centre = geo.addPoint(0.0, 0.0, 0.0)
    low, low_side, high_side, high = (
        geo.addPoint(units.metre * r * math.cos(azimuth), units.metre * r * math.sin(azimuth), 0.0)
        for r, azimuth in (
            (inner, 0.0),
            (inner, geometry.chamber_half_angle(inner)),
            (radius, geometry.chamber_half_angle(radius)),
            (radius, 0.0),
        )
    )
    loop = [
        geo.addCircleArc(low, centre, low_side),
        geo.addLine(low_side, high_side),
        geo.addCircleArc(high_side, centre, high),
        geo.addLine(high, low),
    ]
    for curve, count in zip(loop, counts, strict=True):
        geo.mesh.setTransfiniteCurve(curve, count + 1)
    geo.mesh.setRecombine(2, geo.addPlaneSurface([geo.addCurveLoop(loop)]))
    return loop


def _elements(kind: int, order: list[int], entities: list[int]) -> Int[np.ndarray, "_ _"]:
    """Node tags of the elements of one type on the given curves or surfaces, in the order given."""
    nodes = len(order)
    found = [gmsh.model.mesh.getElementsByType(kind, tag)[1].reshape(-1, nodes) for tag in entities]
    return np.concatenate([np.empty((0, nodes), int), *found]).astype(int)[:, order]


def _counter_clockwise(
    quads: Int[np.ndarray, "quads _"], points: Float[np.ndarray, "nodes 2"], order: int
) -> Int[np.ndarray, "quads _"]:
    grid = quads.reshape(-1, order + 1, order + 1)
    a = points[grid[:, -1, -1]] - points[grid[:, 0, 0]]
    b = points[grid[:, -1, 0]] - points[grid[:, 0, -1]]
    flip = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] < 0.0
    return np.where(flip[:, None, None], np.swapaxes(grid, 1, 2), grid).reshape(quads.shape)
