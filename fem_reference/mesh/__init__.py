"""Meshes of cross-section and body, their reference elements, embedded points and the mirror plane."""

from fem_reference.mesh.body_mesh import BOTTOM as BOTTOM
from fem_reference.mesh.body_mesh import TOP as TOP
from fem_reference.mesh.body_mesh import VTK_HEXAHEDRON as VTK_HEXAHEDRON
from fem_reference.mesh.body_mesh import BodyMesh as BodyMesh
from fem_reference.mesh.body_mesh import actuator_mesh as actuator_mesh
from fem_reference.mesh.body_mesh import body_mesh as body_mesh
from fem_reference.mesh.body_mesh import cut as cut
from fem_reference.mesh.converged_level import converged_level as converged_level
from fem_reference.mesh.cross_section import CAVITY as CAVITY
from fem_reference.mesh.cross_section import CHAMBERS as CHAMBERS
from fem_reference.mesh.cross_section import LEVELS as LEVELS
from fem_reference.mesh.cross_section import OUTER as OUTER
from fem_reference.mesh.cross_section import MeshLevel as MeshLevel
from fem_reference.mesh.cross_section import mesh_level as mesh_level
from fem_reference.mesh.embedding import embed_circles as embed_circles
from fem_reference.mesh.embedding import embed_points as embed_points
from fem_reference.mesh.embedding import merged as merged
from fem_reference.mesh.hexahedron import reference_element as reference_element
from fem_reference.mesh.mirror_plane import MirrorPairs as MirrorPairs
from fem_reference.mesh.mirror_plane import even_mesh as even_mesh
from fem_reference.mesh.mirror_plane import images_with_winding as images_with_winding
from fem_reference.mesh.mirror_plane import mirror_images as mirror_images
from fem_reference.mesh.mirror_plane import mirror_pairs as mirror_pairs
from fem_reference.mesh.mirror_plane import symmetrised as symmetrised
