"""A direction along which a symmetric matrix is negative, found from its factors."""

import numpy as np
import pytest
import scipy.sparse as sparse

from fem_reference.algebra import negative_direction
from fem_reference.algebra.factorisation import PardisoSolver

SIZE = 60


def factorised(eigenvalues: np.ndarray, constraints: int = 0) -> tuple[PardisoSolver, np.ndarray]:
    """Solver of a matrix with these eigenvalues, bordered by constraints; and its dense part."""
    basis, _ = np.linalg.qr(np.random.default_rng(3).standard_normal((SIZE, SIZE)))
    dense = (basis * eigenvalues) @ basis.T
    rows = np.zeros((constraints, SIZE))
    rows[:, :constraints] = 0.1 * np.eye(constraints)
    whole = np.block([[dense, rows.T], [rows, -1e-9 * np.eye(constraints)]])
    solver = PardisoSolver()
    solver.factorise(sparse.csr_matrix(np.triu(whole)), 1)
    return solver, dense


def eigenvalues(*negative: float) -> np.ndarray:
    return np.concatenate([negative, np.linspace(0.5, 9.0, SIZE - len(negative))])


@pytest.mark.parametrize("negative", [(-0.2,), (-3.0,), (-0.4, -2.0, -5.0)])
@pytest.mark.parametrize("constraints", [0, 2])
def test_the_direction_is_one_of_negative_stiffness(negative, constraints):
    solver, dense = factorised(eigenvalues(*negative), constraints)
    way = negative_direction(solver, SIZE + constraints, constraints)
    assert way.shape == (SIZE,)
    assert np.linalg.norm(way) == pytest.approx(1.0)
    assert way @ dense @ way < 0.0


def test_without_constraints_it_is_the_direction_of_the_least_loss():
    solver, dense = factorised(eigenvalues(-0.4, -2.0, -5.0))
    way = negative_direction(solver, SIZE, 0)
    # An eigenvector to 1e-3 has its eigenvalue to 1e-6.
    assert way @ dense @ way == pytest.approx(-0.4, rel=1e-5)


@pytest.mark.parametrize("constraints", [0, 2])
def test_a_positive_matrix_has_none_though_its_constraints_are_negative(constraints):
    solver, _ = factorised(eigenvalues(), constraints)
    assert negative_direction(solver, SIZE + constraints, constraints) is None
