"""Hexahedra of the body: the section's quadrilaterals extruded along z, for one period or with the cap.

Lengths in this file are millimetres.
"""

import numpy as np
import skfem
from jaxtyping import Float, Int

from fem_reference.geometry import ActuatorGeometry
from fem_reference.section import CHAMBERS, MILLIMETRE, MeshLevel, Section, mesh_section

BOTTOM, TOP = "bottom", "top"


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
        ``chamber3``. Nodes of the top face lie straight above those of the bottom face.
    """
    section = mesh_section(geometry, level)
    return _extrude(section, _grid(0.0, length * MILLIMETRE, level.axial_size), np.empty(0))


def actuator_mesh(geometry: ActuatorGeometry, level: MeshLevel) -> skfem.MeshHex:
    """Mesh the body and its cap, which closes the chambers.

    Parameters
    ----------
    geometry : dimensions of the actuator.
    level : element counts; even along the chambers' sides.

    Returns
    -------
    mesh : in mm, with the boundaries of `body_mesh`. The chambers' include their ceilings, where the cap
        begins; the cavity goes through the cap.
    """
    body = geometry.body_length * MILLIMETRE
    end = body + geometry.cap_length * MILLIMETRE
    section = mesh_section(geometry, level, filled=True)
    return _extrude(section, _grid(0.0, body, level.axial_size), _grid(body, end, level.axial_size)[1:])


def _grid(start: float, end: float, size: float) -> Float[np.ndarray, " levels"]:
    return np.linspace(start, end, max(2, round((end - start) / size)) + 1)


def _extrude(
    section: Section, body: Float[np.ndarray, " levels"], cap: Float[np.ndarray, " above"]
) -> skfem.MeshHex:
    """Layers of hexahedra between the levels of the body, and above, chambers filled, those of the cap."""
    levels = np.concatenate([body, cap])
    per_level = len(section.points)
    ceiling = len(body) - 1

    def layers(quads: np.ndarray, first: int, last: int) -> np.ndarray:
        below = quads[None] + per_level * np.arange(first, last)[:, None, None]
        return np.concatenate([below, below + per_level], axis=2).reshape(-1, 8)

    def side(edges: np.ndarray, last: int) -> np.ndarray:
        below = edges[None] + per_level * np.arange(last)[:, None, None]
        return np.concatenate([below, below + per_level], axis=2).reshape(-1, 4)

    top = len(levels) - 1
    hexes = [layers(section.quads, 0, top)]
    named = {BOTTOM: [section.quads], TOP: [section.quads]}
    for name, edges in section.edges.items():
        named[name] = [side(edges, ceiling if name in CHAMBERS else top)]
    if cap.size:
        hexes += [layers(quads, ceiling, top) for quads in section.filling]
        named[TOP] += list(section.filling)
        for name, quads in zip(CHAMBERS, section.filling, strict=True):
            named[name].append(quads + per_level * ceiling)
    named[TOP] = [quads + per_level * top for quads in named[TOP]]

    used, nodes = np.unique(np.concatenate(hexes), return_inverse=True)
    where = np.full(per_level * len(levels), -1)
    where[used] = np.arange(used.size)
    points = np.column_stack([np.tile(section.points, (len(levels), 1)), np.repeat(levels, per_level)])[used]
    # gmsh counts a hexahedron's nodes around its bottom and then its top face; scikit-fem in binary order.
    mesh = skfem.MeshHex(
        np.ascontiguousarray(points.T), np.ascontiguousarray(_binary_order(nodes.reshape(-1, 8)).T)
    )
    return mesh.with_boundaries(
        {name: _facets(mesh, where[np.vstack(quads)]) for name, quads in named.items()}
    )


def _facets(mesh: skfem.MeshHex, quads: Int[np.ndarray, "_ 4"]) -> Int[np.ndarray, " _"]:
    """Indices of the facets with the given nodes."""
    both = np.concatenate([np.sort(mesh.facets.T, axis=1), np.sort(quads, axis=1)])
    _, key = np.unique(both, axis=0, return_inverse=True)
    key = key.ravel()
    count = mesh.facets.shape[1]
    facet = np.empty(key.max() + 1, int)
    facet[key[:count]] = np.arange(count)
    return np.unique(facet[key[count:]])


def _binary_order(hexes: Int[np.ndarray, "hexes 8"]) -> Int[np.ndarray, "hexes 8"]:
    """Reorder 8-node hexahedra from gmsh's to scikit-fem's convention."""
    # scikit-fem's reference nodes, in order; gmsh's: (0,0,0),(1,0,0),(1,1,0),(0,1,0) and the same at z = 1.
    gmsh_nodes = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    order = [gmsh_nodes.index((int(x), int(y), int(z))) for x, y, z in skfem.ElementHex1.doflocs]
    return hexes[:, np.array(order)]
