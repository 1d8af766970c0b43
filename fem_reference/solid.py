"""Hexahedra with a condensed pressure: internal force and tangent of all elements at once.

Element energy, with the isochoric part at the Gauss points and the volumetric part in the mean dilatation of
a linear element, or in the dilatation's projection on linear functions in a quadratic one,

    E_e = Σ_q w_q W_iso(F_q) + V_e κ/2 Σ_j ϑ_j²,    ϑ_j = Σ_q w_q φ_j(q) (det F_q − 1)/V_e,

where the φ_j (1; or 1 and three linear functions of place) are orthogonal: Σ_q w_q φ_i φ_j = V_e δ_ij. The
pressure's coefficients π_j = κ ϑ_j are kept as unknowns of their own while Newton iterates (see `newton`);
they are condensed here, element by element. Lengths mm, stresses MPa.

References
----------
Nagtegaal, Parks, Rice (1974); Simo, Taylor, Pister (1985): mean dilatation. Sussman and Bathe (1987), A
finite element formulation for nonlinear incompressible elastic and inelastic analysis, Comput. Struct. 26:
the 27/4-c element, of quadratic displacements and linear discontinuous pressure.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from jaxtyping import Float

from fem_reference.material import Ogden, isochoric_energy, isochoric_response, isochoric_stress
from fem_reference.mesh import BodyMesh
from fem_reference.reference_element import reference_element
from fem_reference.screw import LEVI_CIVITA

_MPA = 1e6

# ε_ikm ε_JLN as a matrix from F_mN to ∂²(det F)/∂F_iJ∂F_kL.
_DETERMINANT_HESSIAN = np.einsum("ikm,JLN->mNiJkL", LEVI_CIVITA, LEVI_CIVITA).reshape(9, 81)

# Gauss points worked on at once: their arrays stay in a processor's cache. As many threads as OpenMP has.
_CHUNK = 2048
_THREADS = int((os.environ.get("OMP_NUM_THREADS") or str(os.cpu_count() or 1)).split(",")[0])
_POOL = ThreadPoolExecutor(_THREADS)


class SolidElements:
    """All hexahedra of a mesh with one material.

    Parameters
    ----------
    mesh : hexahedra [mm], linear or quadratic.
    material : Ogden solid.
    """

    def __init__(self, mesh: BodyMesh, material: Ogden) -> None:
        reference = reference_element(mesh.order)
        self.material = material
        self.connectivity = mesh.elements
        self.bulk_modulus = material.bulk_modulus / _MPA
        corner = mesh.points[self.connectivity]
        # ∂X_i/∂ξ_j at every Gauss point.
        mapping = np.einsum("eai,qaj->eqij", corner, reference.gradients)
        #: ∂N_a/∂X_J, (element, point, node, direction).
        self._gradients = reference.gradients @ np.linalg.inv(mapping)
        elements, points, nodes, _ = self._gradients.shape
        # (element, point·direction, node), to contract over points and directions in one product.
        self._stacked = np.ascontiguousarray(
            self._gradients.transpose(0, 1, 3, 2).reshape(elements, points * 3, nodes)
        )
        self._weights = reference.weights * np.linalg.det(mapping)
        self.volume = self._weights.sum(axis=1)
        #: Share of the body's volume that belongs to each node [mm³].
        self.nodal_volumes = np.bincount(
            self.connectivity.ravel(), weights=(self._weights @ reference.values).ravel()
        )
        self._modes = _pressure_modes(reference.values @ corner, self._weights, mesh.order)
        self._chunk_size = max(_CHUNK // points, 1)

    def __len__(self) -> int:
        return len(self.connectivity)

    @property
    def modes(self) -> int:
        """Pressure coefficients of an element."""
        return self._modes.shape[2]

    def deformation_gradient(
        self, positions: Float[np.ndarray, "nodes 3"]
    ) -> Float[np.ndarray, "elements points 3 3"]:
        """F at every Gauss point."""
        local = positions[self.connectivity]  # (element, node, 3)
        return np.swapaxes(local, 1, 2)[:, None] @ self._gradients

    def dilatation(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "elements modes"]:
        """ϑ_j of every element; the first is the mean of det F − 1."""
        growth = self._weights * (np.linalg.det(self.deformation_gradient(positions)) - 1.0)
        return (growth[:, None] @ self._modes)[:, 0] / self.volume[:, None]

    def energy(self, positions: Float[np.ndarray, "nodes 3"]) -> float:
        """Strain energy of the mesh [N mm]."""
        F = self.deformation_gradient(positions)
        isochoric = (self._weights * isochoric_energy(self.material, _MPA, F)).sum()
        squares = (self.dilatation(positions) ** 2).sum(axis=1)
        return float(isochoric + 0.5 * self.bulk_modulus * (self.volume * squares).sum())

    def pressure_after(
        self,
        positions: Float[np.ndarray, "nodes 3"],
        volume_gradient: Float[np.ndarray, "elements modes dofs"],
        move: Float[np.ndarray, "nodes 3"],
    ) -> Float[np.ndarray, "elements modes"]:
        """π_j that a linearised displacement ``move`` leads to: what was condensed out of the step."""
        local = move[self.connectivity].reshape(len(self), -1, 1)
        growth = (volume_gradient @ local)[:, :, 0] / self.volume[:, None]
        return self.bulk_modulus * (self.dilatation(positions) + growth)

    def response(
        self,
        positions: Float[np.ndarray, "nodes 3"],
        pressure: Float[np.ndarray, "elements modes"] | None = None,
    ) -> tuple[
        Float[np.ndarray, "elements dofs"],
        Float[np.ndarray, "elements dofs dofs"],
        Float[np.ndarray, "elements modes dofs"],
    ]:
        """Element forces, tangents and V_e ∂ϑ_j/∂x.

        Parameters
        ----------
        positions : current positions of the nodes [mm].
        pressure : π_j of the tangent's geometric part [MPa]; by default κ ϑ_j, which makes the tangent the
            exact Hessian of the energy.
        """
        count, dofs = len(self), 3 * self.connectivity.shape[1]
        force, stiffness = np.empty((count, dofs)), np.empty((count, dofs, dofs))
        volume_gradient = np.empty((count, self.modes, dofs))

        def fill(part: slice) -> None:
            given = None if pressure is None else pressure[part]
            force[part], stiffness[part], volume_gradient[part] = self._chunk(positions, given, part)

        self._in_chunks(fill)
        return force, stiffness, volume_gradient

    def force(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "elements dofs"]:
        """Element forces alone, those of `response`."""
        force = np.empty((len(self), 3 * self.connectivity.shape[1]))

        def fill(part: slice) -> None:
            weights, modes = self._weights[part], self._modes[part]
            F = np.swapaxes(positions[self.connectivity[part]], 1, 2)[:, None] @ self._gradients[part]
            cofactor = _cofactor(F)
            growth = weights * ((F[..., 0, :] * cofactor[..., 0, :]).sum(axis=-1) - 1.0)
            dilatation = (growth[:, None] @ modes)[:, 0] / self.volume[part, None]
            pressure = self.bulk_modulus * (modes @ dilatation[:, :, None])
            stress = isochoric_stress(self.material, _MPA, F) + pressure[..., None] * cofactor
            force[part] = _gather(self._stacked[part], stress * weights[..., None, None])

        self._in_chunks(fill)
        return force

    def viscosity(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, "elements dofs dofs"]:
        """Element matrices of ∫ 2μ D:D dV, D the deviator of the rate of strain where the body is now.

        That of a viscous solid with a relaxation time of one. Rigid motions cost nothing.
        """
        count, dofs = len(self), 3 * self.connectivity.shape[1]
        matrices = np.empty((count, dofs, dofs))
        modulus = self.material.shear_modulus / _MPA

        def fill(part: slice) -> None:
            gradients = self._gradients[part]
            F = np.swapaxes(positions[self.connectivity[part]], 1, 2)[:, None] @ gradients
            inverse = np.linalg.inv(F)
            # 2 D:D = |δF F⁻¹|² + δF F⁻¹ : (δF F⁻¹)ᵀ − ⅔ (tr δF F⁻¹)².
            rate = np.einsum("ik,eqJm,eqLm->eqiJkL", np.eye(3), inverse, inverse)
            rate += np.einsum("eqJk,eqLi->eqiJkL", inverse, inverse)
            rate -= 2.0 / 3.0 * np.einsum("eqJi,eqLk->eqiJkL", inverse, inverse)
            weights = modulus * self._weights[part][..., None, None]
            tangent = rate.reshape(*inverse.shape[:2], 9, 9) * weights
            matrices[part] = _stiffness(tangent, gradients, self._stacked[part])

        self._in_chunks(fill)
        return matrices

    def _in_chunks(self, fill: Callable[[slice], None]) -> None:
        """Call ``fill`` for all elements, some at a time."""
        parts = [slice(k, k + self._chunk_size) for k in range(0, len(self), self._chunk_size)]
        # NumPy lets go of the interpreter in its loops; chunks do not depend on each other.
        for _ in _POOL.map(fill, parts):
            pass

    def _chunk(
        self, positions: Float[np.ndarray, "nodes 3"], pressure: np.ndarray | None, part: slice
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`response` of some elements."""
        gradients, volume, stacked = self._gradients[part], self.volume[part], self._stacked[part]
        modes = self._modes[part]
        F = np.swapaxes(positions[self.connectivity[part]], 1, 2)[:, None] @ gradients
        elements, points = self._weights[part].shape
        weights = self._weights[part]
        cofactor = _cofactor(F)
        growth = weights * ((F[..., 0, :] * cofactor[..., 0, :]).sum(axis=-1) - 1.0)
        constitutive = self.bulk_modulus * (growth[:, None] @ modes)[:, 0] / volume[:, None]
        if pressure is None:
            pressure = constitutive

        stress, tangent = isochoric_response(self.material, _MPA, F)
        at_points = (modes @ pressure[:, :, None])[..., 0]
        tangent += (at_points[:, :, None] * (F.reshape(elements, points, 9) @ _DETERMINANT_HESSIAN)).reshape(
            elements, points, 9, 9
        )
        tangent *= weights[..., None, None]
        volume_gradient = np.stack(
            [
                _gather(stacked, cofactor * (weights * modes[:, :, j])[..., None, None])
                for j in range(modes.shape[2])
            ],
            axis=1,
        )
        force = _gather(stacked, stress * weights[..., None, None])
        force += (constitutive[:, None] @ volume_gradient)[:, 0]

        stiffness = _stiffness(tangent, gradients, stacked)
        stiffness += np.swapaxes(volume_gradient, 1, 2) @ (
            (self.bulk_modulus / volume)[:, None, None] * volume_gradient
        )
        return force, stiffness, volume_gradient


def _stiffness(
    tangent: Float[np.ndarray, "elements points 9 9"],
    gradients: Float[np.ndarray, "elements points nodes 3"],
    stacked: Float[np.ndarray, "elements _ nodes"],
) -> Float[np.ndarray, "elements dofs dofs"]:
    """K_(ai)(bk) = Σ_q dN_aJ A_iJkL dN_bL: first over J at each point, then over (q, L) in one product."""
    elements, points, nodes, _ = gradients.shape
    by_row = np.ascontiguousarray(
        tangent.reshape(elements, points, 3, 3, 3, 3).transpose(0, 1, 3, 2, 4, 5)
    ).reshape(elements, points, 3, 27)
    half = (gradients @ by_row).reshape(elements, points, 9 * nodes, 3)
    half = np.ascontiguousarray(half.transpose(0, 2, 1, 3)).reshape(elements, 9 * nodes, points * 3)
    return (
        (half @ stacked)
        .reshape(elements, nodes, 3, 3, nodes)
        .transpose(0, 1, 2, 4, 3)
        .reshape(elements, 3 * nodes, 3 * nodes)
    )


def _pressure_modes(
    places: Float[np.ndarray, "elements points 3"], weights: Float[np.ndarray, "elements points"], order: int
) -> Float[np.ndarray, "elements points modes"]:
    """Functions φ_j at the Gauss points: constant, and of quadratic elements linear in the place at rest."""
    volume = weights.sum(axis=1)[:, None, None]
    functions = np.ones((*weights.shape, 1))
    if order == 2:
        centre = (weights[:, None] @ places) / volume
        functions = np.concatenate([functions, (places - centre) / np.cbrt(volume)], axis=2)
    gram = np.swapaxes(functions, 1, 2) @ (weights[:, :, None] * functions) / volume
    return functions @ np.swapaxes(np.linalg.inv(np.linalg.cholesky(gram)), 1, 2)


def _gather(
    stacked: Float[np.ndarray, "elements _ nodes"], weighted: Float[np.ndarray, "elements points 3 3"]
) -> Float[np.ndarray, "elements dofs"]:
    """Σ_q dN_aJ T_iJ for every element, as (a, i)."""
    elements = len(stacked)
    # (element, point·J, i), from T_iJ.
    columns = np.swapaxes(weighted, -1, -2).reshape(elements, -1, 3)
    return (np.swapaxes(stacked, 1, 2) @ columns).reshape(elements, -1)


def _cofactor(F: Float[np.ndarray, "*batch 3 3"]) -> Float[np.ndarray, "*batch 3 3"]:
    """Cofactor of F, ∂(det F)/∂F."""
    rows = [np.cross(F[..., (i + 1) % 3, :], F[..., (i + 2) % 3, :]) for i in range(3)]
    return np.stack(rows, axis=-2)
