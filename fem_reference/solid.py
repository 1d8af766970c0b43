"""Hexahedra with mean dilatation: internal force and tangent of all elements at once.

Element energy, with the isochoric part at the eight Gauss points and one dilatation per element,

    E_e = Σ_q w_q W_iso(F_q) + V_e κ/2 (v_e/V_e − 1)²,    v_e = Σ_q w_q det F_q.

The pressure π_e = κ(v_e/V_e − 1) is kept as an unknown of its own while Newton iterates (see `newton`); it is
condensed here, element by element. Lengths mm, stresses MPa.

References
----------
Nagtegaal, Parks, Rice (1974); Simo, Taylor, Pister (1985): mean dilatation.
"""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import skfem
from jaxtyping import Float

from fem_reference.material import Ogden, isochoric_energy, isochoric_response

_MPA = 1e6

# ε_ikm ε_JLN as a matrix from F_mN to ∂²(det F)/∂F_iJ∂F_kL.
_LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[_i, _j, _k] = 1.0
    _LEVI_CIVITA[_j, _i, _k] = -1.0
_DETERMINANT_HESSIAN = np.einsum("ikm,JLN->mNiJkL", _LEVI_CIVITA, _LEVI_CIVITA).reshape(9, 81)


# Elements worked on at once: their arrays stay in a processor's cache. As many threads as OpenMP would have.
_CHUNK = 256
_THREADS = int((os.environ.get("OMP_NUM_THREADS") or str(os.cpu_count() or 1)).split(",")[0])
_POOL = ThreadPoolExecutor(_THREADS)


class SolidElements:
    """All hexahedra of a mesh with one material.

    Parameters
    ----------
    mesh : hexahedral mesh [mm].
    material : Ogden solid.
    """

    def __init__(self, mesh: skfem.MeshHex, material: Ogden) -> None:
        basis = skfem.Basis(mesh, skfem.ElementHex1(), intorder=3)
        self.material = material
        self.connectivity = np.ascontiguousarray(basis.element_dofs.T)
        gradients = np.stack([basis.basis[a][0].grad for a in range(8)])  # (node, direction, element, point)
        self._gradients = np.ascontiguousarray(
            gradients.transpose(2, 3, 0, 1)
        )  # (element, point, node, direction)
        elements, points = basis.dx.shape
        # (element, point·direction, node), to contract over points and directions in one product.
        self._stacked = np.ascontiguousarray(gradients.transpose(2, 3, 1, 0).reshape(elements, points * 3, 8))
        self._weights = basis.dx.copy()
        self.volume = self._weights.sum(axis=1)
        self.bulk_modulus = material.bulk_modulus / _MPA

    def __len__(self) -> int:
        return len(self.connectivity)

    def deformation_gradient(
        self, positions: Float[np.ndarray, "nodes 3"]
    ) -> Float[np.ndarray, "elements points 3 3"]:
        """F at every Gauss point."""
        local = positions[self.connectivity]  # (element, node, 3)
        return np.swapaxes(local, 1, 2)[:, None] @ self._gradients

    def dilatation(self, positions: Float[np.ndarray, "nodes 3"]) -> Float[np.ndarray, " elements"]:
        """v_e/V_e of every element."""
        return (self._weights * np.linalg.det(self.deformation_gradient(positions))).sum(axis=1) / self.volume

    def energy(self, positions: Float[np.ndarray, "nodes 3"]) -> float:
        """Strain energy of the mesh [N mm]."""
        F = self.deformation_gradient(positions)
        isochoric = (self._weights * isochoric_energy(self.material, _MPA, F)).sum()
        dilatation = (self._weights * np.linalg.det(F)).sum(axis=1) / self.volume
        return float(isochoric + (self.volume * self.bulk_modulus / 2.0 * (dilatation - 1.0) ** 2).sum())

    def response(
        self, positions: Float[np.ndarray, "nodes 3"], pressure: Float[np.ndarray, " elements"] | None = None
    ) -> tuple[
        Float[np.ndarray, "elements 24"],
        Float[np.ndarray, "elements 24 24"],
        Float[np.ndarray, "elements 24"],
    ]:
        """Element forces, tangents and ∂v_e/∂x.

        Parameters
        ----------
        positions : current positions of the nodes [mm].
        pressure : π_e of the tangent's geometric part [MPa]; by default κ(v_e/V_e − 1), which makes the
            tangent the
            exact Hessian of the energy.
        """
        count = len(self)
        force, stiffness, volume_gradient = (
            np.empty((count, 24)),
            np.empty((count, 24, 24)),
            np.empty((count, 24)),
        )

        def fill(start: int) -> None:
            part = slice(start, start + _CHUNK)
            given = None if pressure is None else pressure[part]
            force[part], stiffness[part], volume_gradient[part] = self._chunk(positions, given, part)

        # NumPy lets go of the interpreter in its loops; chunks do not depend on each other.
        for _ in _POOL.map(fill, range(0, count, _CHUNK)):
            pass
        return force, stiffness, volume_gradient

    def _chunk(
        self, positions: Float[np.ndarray, "nodes 3"], pressure: np.ndarray | None, part: slice
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`response` of some elements."""
        gradients, volume, stacked = self._gradients[part], self.volume[part], self._stacked[part]
        F = np.swapaxes(positions[self.connectivity[part]], 1, 2)[:, None] @ gradients
        elements, points = self._weights[part].shape
        weights = self._weights[part][..., None, None]
        cofactor = _cofactor(F)
        jacobian = (F[..., 0, :] * cofactor[..., 0, :]).sum(axis=-1)
        constitutive = self.bulk_modulus * ((self._weights[part] * jacobian).sum(axis=1) / volume - 1.0)
        if pressure is None:
            pressure = constitutive

        stress, tangent = isochoric_response(self.material, _MPA, F)
        tangent += (
            pressure[:, None, None] * (F.reshape(elements, points, 9) @ _DETERMINANT_HESSIAN)
        ).reshape(elements, points, 9, 9)
        tangent *= weights
        volume_gradient = _gather(stacked, cofactor * weights)
        force = _gather(stacked, stress * weights) + constitutive[:, None] * volume_gradient

        # K_(ai)(bk) = Σ_q dN_aJ A_iJkL dN_bL: first over J at each point, then over (q, L) in one product.
        by_row = np.ascontiguousarray(
            tangent.reshape(elements, points, 3, 3, 3, 3).transpose(0, 1, 3, 2, 4, 5)
        ).reshape(elements, points, 3, 27)
        half = (gradients @ by_row).reshape(elements, points, 72, 3)
        half = np.ascontiguousarray(half.transpose(0, 2, 1, 3)).reshape(elements, 72, points * 3)
        stiffness = (
            (half @ stacked).reshape(elements, 8, 3, 3, 8).transpose(0, 1, 2, 4, 3).reshape(elements, 24, 24)
        )
        stiffness += (self.bulk_modulus / volume)[:, None, None] * (
            volume_gradient[:, :, None] * volume_gradient[:, None, :]
        )
        return force, stiffness, volume_gradient


def _gather(
    stacked: Float[np.ndarray, "elements _ 8"], weighted: Float[np.ndarray, "elements points 3 3"]
) -> Float[np.ndarray, "elements 24"]:
    """Σ_q dN_aJ T_iJ for every element, as (a, i)."""
    elements = len(stacked)
    # (element, point·J, i), from T_iJ.
    columns = np.swapaxes(weighted, -1, -2).reshape(elements, -1, 3)
    return (np.swapaxes(stacked, 1, 2) @ columns).reshape(elements, 24)


def _cofactor(F: Float[np.ndarray, "*batch 3 3"]) -> Float[np.ndarray, "*batch 3 3"]:
    """Cofactor of F, ∂(det F)/∂F."""
    rows = [np.cross(F[..., (i + 1) % 3, :], F[..., (i + 2) % 3, :]) for i in range(3)]
    return np.stack(rows, axis=-2)
