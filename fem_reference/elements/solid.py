"""Mixed hexahedra with condensed pressures: internal forces and tangents of all elements at once.

The isochoric energy is integrated at the Gauss points. The volumetric energy uses the mean dilatation in a
linear element, and the projection of the dilatation on linear functions in a quadratic one:

    E_e = Σ_q w_q W_iso(F_q) + V_e κ/2 Σ_j ϑ_j²,    ϑ_j = Σ_q w_q φ_j(q) (det F_q − 1)/V_e,

where the φ_j (1; or 1 and three linear functions of position) are orthogonal: Σ_q w_q φ_i φ_j = V_e δ_ij. The
pressure coefficients π_j = κ ϑ_j are separate unknowns while Newton's method iterates (see `newton`); they
are condensed here, element by element. Lengths mm, stresses MPa.

References
----------
Nagtegaal, Parks, Rice (1974); Simo, Taylor, Pister (1985): mean dilatation. Sussman and Bathe (1987), A
finite element formulation for nonlinear incompressible elastic and inelastic analysis, Comput. Struct. 26:
the 27/4-c element, of quadratic displacements and linear discontinuous pressure.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from fem_reference.elements import hexahedron_kernel
from fem_reference.elements.hexahedron_kernel import ElementChunk
from fem_reference.geometry import SI, Units
from fem_reference.materials import Material
from fem_reference.mesh import BodyMesh, MirrorPairs, reference_element

# Gauss points in one chunk: few enough for the processor's cache, and no power of two, which would map all
# arrays to the same cache lines.
_CHUNK = 1920
# As many threads as OpenMP has.
_THREADS = int((os.environ.get("OMP_NUM_THREADS") or str(os.cpu_count() or 1)).split(",")[0])
_POOL = ThreadPoolExecutor(_THREADS)


class SolidElements:
    """All hexahedra of a mesh with one material.

    Parameters
    ----------
    mesh : hexahedra [mm], linear or quadratic.
    material : of all hexahedra.
    halves : mirror pairs of hexahedra. Only the kept ones are computed, each weighted by the number that it
        stands for; by default all are.
    units : of the mesh, and of stresses.
    """

    def __init__(
        self, mesh: BodyMesh, material: Material, halves: MirrorPairs | None = None, units: Units = SI
    ) -> None:
        reference = reference_element(mesh.order)
        self.material = material
        self.connectivity = mesh.elements if halves is None else mesh.elements[halves.kept]
        self.bulk_modulus = material.bulk_modulus / units.megapascal
        self._shear_modulus = material.shear_modulus / units.megapascal
        corner = mesh.points[self.connectivity]
        # ∂X_i/∂ξ_j at every Gauss point.
        mapping = np.einsum("eai,qaj->eqij", corner, reference.gradients)
        gradients = reference.gradients @ np.linalg.inv(mapping)
        weights = reference.weights * np.linalg.det(mapping)
        if halves is not None:
            weights *= halves.counts[:, None]
        self.volume = weights.sum(axis=1)
        #: Share of the body's volume that belongs to each node [mm³].
        self.nodal_volumes = np.bincount(
            self.connectivity.ravel(), (weights @ reference.values).ravel(), len(mesh.points)
        )
        modes = _pressure_modes(reference.values @ corner, weights, mesh.order)
        #: Number of pressure coefficients of an element.
        self.modes = modes.shape[2]
        # All chunks have one size, for one compilation: the last is padded with its last element.
        size = max(_CHUNK // weights.shape[1], 1)
        self._starts = range(0, len(corner), size)
        members = [np.minimum(np.arange(start, start + size), len(corner) - 1) for start in self._starts]
        self._members = [self.connectivity[chosen] for chosen in members]
        with jax.enable_x64(True):
            self._constants = (material.isochoric(units.megapascal), jnp.asarray(self.bulk_modulus))
            self._chunks = [
                ElementChunk(
                    gradients=jnp.asarray(np.ascontiguousarray(gradients[chosen].transpose(2, 3, 1, 0))),
                    weights=jnp.asarray(np.ascontiguousarray(weights[chosen].T)),
                    modes=jnp.asarray(np.ascontiguousarray(modes[chosen].transpose(2, 1, 0))),
                    volume=jnp.asarray(self.volume[chosen]),
                )
                for chosen in members
            ]

    def __len__(self) -> int:
        return len(self.connectivity)

    def deformation_gradient(
        self, positions: Float[np.ndarray, "nodes 3"]
    ) -> Float[np.ndarray, "elements points 3 3"]:
        """F at every Gauss point."""
        result = np.empty((len(self), self._chunks[0].weights.shape[0], 3, 3))

        def fill(part: slice, chunk: ElementChunk, local: np.ndarray) -> None:
            found = np.einsum("aie,aJqe->eqiJ", local, np.asarray(chunk.gradients))
            result[part] = found[: len(result[part])]

        self._in_chunks(fill, positions)
        return result

    def extreme_stretches(self, positions: Float[np.ndarray, "nodes 3"]) -> tuple[float, float]:
        """Return the least and the largest principal stretch at all Gauss points."""
        F = self.deformation_gradient(positions)
        squared = np.linalg.eigvalsh(np.swapaxes(F, -1, -2) @ F)
        return float(np.sqrt(squared[..., 0].min())), float(np.sqrt(squared[..., 2].max()))

    def dilatation(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "elements modes"]:
        """Return ϑ_j of every element; the first is the mean of det F − 1."""
        result = np.empty((len(self), self.modes))

        def fill(part: slice, chunk: ElementChunk, local: np.ndarray) -> None:
            found = np.asarray(hexahedron_kernel.dilatation(chunk, local))
            result[part] = found.T[: len(result[part])]

        self._in_chunks(fill, positions)
        return result

    def energy(self, positions: Float[np.ndarray, "nodes 3"]) -> float:
        """Strain energy of the mesh [N mm]."""
        result = np.empty(len(self))

        def fill(part: slice, chunk: ElementChunk, local: np.ndarray) -> None:
            found = np.asarray(hexahedron_kernel.energy(chunk, *self._constants, local))
            result[part] = found[: len(result[part])]

        self._in_chunks(fill, positions)
        return float(result.sum())

    def pressure_after(
        self,
        constitutive: Float[np.ndarray, "elements modes"],
        volume_gradient: Float[np.ndarray, "elements modes dofs"],
        move: Float[np.ndarray, "nodes 3"],
    ) -> Float[np.ndarray, "elements modes"]:
        """Recover the condensed π_j [MPa] after a displacement ``move`` [mm], to first order.

        ``constitutive`` and ``volume_gradient`` come from `response` at the start of the displacement.
        """
        local = move[self.connectivity].reshape(len(self), -1, 1)
        growth = (volume_gradient @ local)[:, :, 0] / self.volume[:, None]
        return constitutive + self.bulk_modulus * growth

    def response(
        self,
        positions: Float[np.ndarray, "nodes 3"],
        pressure: Float[np.ndarray, "elements modes"] | None = None,
    ) -> tuple[
        Float[np.ndarray, "elements dofs"],
        Float[np.ndarray, "elements dofs dofs"],
        Float[np.ndarray, "elements modes dofs"],
        Float[np.ndarray, "elements modes"],
    ]:
        """Return element forces, tangents, V_e ∂ϑ_j/∂x and κ ϑ_j [MPa].

        Parameters
        ----------
        positions : current positions of the nodes [mm].
        pressure : π_j in the geometric part of the tangent [MPa]; by default κ ϑ_j, which makes the tangent
            the exact Hessian of the energy.
        """
        nodes = self.connectivity.shape[1]
        force, stiffness = np.empty((len(self), 3 * nodes)), np.empty((len(self), 3 * nodes, 3 * nodes))
        volume_gradient = np.empty((len(self), self.modes, 3 * nodes))
        constitutive = np.empty((len(self), self.modes))

        def fill(part: slice, chunk: ElementChunk, local: np.ndarray) -> None:
            given = None
            if pressure is not None:
                given = np.zeros((self.modes, local.shape[2]))
                given[:, : len(force[part])] = pressure[part].T
            forces, growth, matrices, own = hexahedron_kernel.response(chunk, *self._constants, local, given)
            force[part] = _by_element(forces)[: len(force[part])]
            volume_gradient[part] = _by_element(growth)[: len(force[part])]
            stiffness[part] = _matrices(matrices)[: len(force[part])]
            constitutive[part] = np.asarray(own).T[: len(force[part])]

        self._in_chunks(fill, positions)
        return force, stiffness, volume_gradient, constitutive

    def force(
        self, positions: Float[np.ndarray, "nodes 3"]
    ) -> tuple[Float[np.ndarray, "elements dofs"], Float[np.ndarray, "elements modes"]]:
        """Return only the element forces and κ ϑ_j [MPa] of `response`."""
        result = np.empty((len(self), 3 * self.connectivity.shape[1]))
        constitutive = np.empty((len(self), self.modes))

        def fill(part: slice, chunk: ElementChunk, local: np.ndarray) -> None:
            found, own = hexahedron_kernel.force(chunk, *self._constants, local)
            result[part] = _by_element(found)[: len(result[part])]
            constitutive[part] = np.asarray(own).T[: len(result[part])]

        self._in_chunks(fill, positions)
        return result, constitutive

    def viscosity(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "elements dofs dofs"]:
        """Return element matrices of ∫ 2μ D:D dV, with D the deviatoric strain rate at these positions.

        They belong to a viscous solid with a relaxation time of one. Rigid motions have no resistance.
        """
        dofs = 3 * self.connectivity.shape[1]
        matrices = np.empty((len(self), dofs, dofs))

        def fill(part: slice, chunk: ElementChunk, local: np.ndarray) -> None:
            found = hexahedron_kernel.viscosity(chunk, self._shear_modulus, local)
            matrices[part] = _matrices(found)[: len(matrices[part])]

        self._in_chunks(fill, positions)
        return matrices

    def _in_chunks(
        self,
        fill: Callable[[slice, ElementChunk, Float[np.ndarray, "nodes 3 elements"]], None],
        positions: Float[np.ndarray, "nodes 3"],
    ) -> None:
        """Call ``fill`` for every chunk of elements, with their nodes' positions."""

        def at(start: int, chunk: ElementChunk, members: np.ndarray) -> None:
            local = np.ascontiguousarray(positions[members].transpose(1, 2, 0))
            # The setting is thread-local.
            with jax.enable_x64(True):
                fill(slice(start, start + len(members)), chunk, local)

        # Compiled code releases the interpreter lock, and chunks are independent.
        over = map if _THREADS == 1 else _POOL.map
        for _ in over(at, self._starts, self._chunks, self._members):
            pass


def _by_element(values: Any) -> Float[np.ndarray, "elements ..."]:
    """Reorder nodal values (…, node, 3, element) to (element, …, 3 node + i)."""
    values = np.moveaxis(np.asarray(values), -1, 0)
    return values.reshape(*values.shape[:-2], -1)


def _matrices(values: Any) -> Float[np.ndarray, "elements dofs dofs"]:
    """Reorder matrices (node, 3, node, 3, element) to (element, 3 node + i, 3 node + k)."""
    dofs = values.shape[0] * 3
    return np.asarray(values).reshape(dofs * dofs, -1).T.reshape(-1, dofs, dofs)


def _pressure_modes(
    places: Float[np.ndarray, "elements points 3"], weights: Float[np.ndarray, "elements points"], order: int
) -> Float[np.ndarray, "elements points modes"]:
    """Return φ_j at the Gauss points: 1, and in quadratic elements three linear functions of position."""
    volume = weights.sum(axis=1)[:, None, None]
    functions = np.ones((*weights.shape, 1))
    if order == 2:
        centre = (weights[:, None] @ places) / volume
        functions = np.concatenate([functions, (places - centre) / np.cbrt(volume)], axis=2)
    gram = np.swapaxes(functions, 1, 2) @ (weights[:, :, None] * functions) / volume
    return functions @ np.swapaxes(np.linalg.inv(np.linalg.cholesky(gram)), 1, 2)
