"""Single precision with refinement solves as double precision does, and gives way to it where it cannot."""

import logging
import sys

import numpy as np
import pytest
import scipy.sparse as sparse

from fem_reference import Actuator, ActuatorGeometry, ActuatorLoad, MeshLevel
from fem_reference.linear_solver import PardisoSolver, SingularMatrixError, SuperLuSolver, default_solver
from fem_reference.mixed_solver import MixedSolver

# What GMRES leaves of a solution, as the factors see it.
ACCURACY = 1e-5


@pytest.fixture(scope="module")
def stiffness() -> tuple[sparse.csr_matrix, np.ndarray]:
    """Stiffness of a slender actuator with thread and rod at rest, and forces on it."""
    actuator = Actuator(ActuatorGeometry(), level=MeshLevel(2, 4, 2, 2, 1, 1, 1, 1.5))
    equations = actuator.equations
    linear = equations.linearise(equations.rest(), ActuatorLoad((1e3, 0.0, 0.0)).target())
    right = np.column_stack([-linear.residual, np.random.default_rng(0).standard_normal(equations.size)])
    return equations.pattern.matrix(linear.data), right


def upper(matrix: np.ndarray) -> sparse.csr_matrix:
    return sparse.csr_matrix(sparse.triu(sparse.csr_matrix(matrix)))


def test_the_stiffness_of_a_slender_body_is_solved_as_in_double_precision(stiffness):
    matrix, right = stiffness
    mixed, double = MixedSolver(), PardisoSolver()
    assert mixed.factorise(matrix, 0) == double.factorise(matrix, 0) == 0
    found, expected = mixed.solve(right), double.solve(right)
    size = np.linalg.norm(expected, axis=0)
    error = np.linalg.norm(found - expected, axis=0) / size
    alone = np.column_stack([mixed._factors.solve(column) for column in right.T])
    coarse = np.linalg.norm(alone - expected, axis=0) / size
    # Of an error e the factors see e less what they miss of it, here up to 0.6 |e|: 0.4 |e| or more.
    assert coarse.max() < 0.6
    assert error.max() < ACCURACY / 0.4
    assert coarse.min() > 10.0 * error.max()


def test_an_indefinite_stiffness_is_solved_too_and_its_inertia_counted(stiffness):
    """Less by a multiple of its diagonal, so that its softest motions have negative stiffness."""
    matrix, right = stiffness
    shifted = matrix - 1e-3 * sparse.diags(matrix.diagonal())
    shifted = shifted.tocsr()
    mixed, double = MixedSolver(), PardisoSolver()
    negative = double.factorise(shifted, 0)
    assert negative > 3
    assert mixed.factorise(shifted, 0) == negative
    found = mixed.solve(right)
    full = shifted + sparse.triu(shifted, 1).T
    for column, force in zip(found.T, right.T, strict=True):
        # What is missing as the factors see it is what is asked for, and a solution's rounding.
        missing = np.linalg.norm(mixed._factors.solve(force - full @ column))
        assert missing <= 1.1 * ACCURACY * np.linalg.norm(mixed._factors.solve(force))


def test_a_new_matrix_or_pattern_replaces_the_old():
    rng = np.random.default_rng(1)
    mixed, right = MixedSolver(), rng.standard_normal((30, 2))
    for revision, offset in ((0, 1), (0, 1), (1, 4)):
        matrix = np.diag(rng.uniform(3.0, 5.0, 30)) + np.eye(30, k=offset) + np.eye(30, k=-offset)
        mixed.factorise(upper(matrix), revision)
        np.testing.assert_allclose(mixed.solve(right), np.linalg.solve(matrix, right), rtol=0, atol=ACCURACY)


def test_double_precision_takes_over_where_single_does_not_do(caplog):
    """A condition number of 1e11 after scaling: single precision factorises another matrix."""
    rng = np.random.default_rng(2)
    basis = np.linalg.qr(rng.standard_normal((60, 60)))[0]
    matrix = (basis * np.geomspace(1e-11, 1.0, 60)) @ basis.T
    matrix = 0.5 * (matrix + matrix.T)
    right = rng.standard_normal((60, 1))
    mixed = MixedSolver()
    with caplog.at_level(logging.DEBUG, logger="fem_reference.mixed_solver"):
        mixed.factorise(upper(matrix), 0)
        found = mixed.solve(right)
        again = mixed.solve(right)
    assert "factorised in double" in caplog.text
    # A solution to round-off, backward: 60 products of a row, twice.
    scale = np.linalg.norm(matrix, 2) * np.linalg.norm(found)
    assert np.linalg.norm(matrix @ found - right) < 1e-13 * scale
    np.testing.assert_array_equal(found, again)


def test_no_force_no_displacement(stiffness):
    matrix, right = stiffness
    mixed = MixedSolver()
    mixed.factorise(matrix, 0)
    np.testing.assert_array_equal(mixed.solve(np.zeros_like(right)), 0.0)


def test_a_singular_matrix_is_refused():
    """A floating chain under a force that nothing balances."""
    chain = 2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    chain[0, 0] = chain[-1, -1] = 1.0
    mixed = MixedSolver()

    def solve():
        mixed.factorise(upper(chain), 0)
        mixed.solve(np.ones((4, 1)))

    with pytest.raises(SingularMatrixError):
        solve()


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_matrix_that_is_not_finite_is_refused(value):
    matrix = np.diag([3.0, value, 3.0]) + 0.1
    mixed = MixedSolver()

    def solve():
        mixed.factorise(upper(matrix), 0)
        mixed.solve(np.ones((3, 1)))

    with pytest.raises(SingularMatrixError):
        solve()


def test_solving_before_factorising_says_so():
    with pytest.raises(RuntimeError, match="before factorise"):
        MixedSolver().solve(np.ones((3, 1)))


def test_it_is_the_default_for_definite_matrices_where_mkl_is_installed(monkeypatch):
    assert isinstance(default_solver(definite=True), MixedSolver)
    monkeypatch.setitem(sys.modules, "pypardiso", None)
    assert isinstance(default_solver(definite=True), SuperLuSolver)


def test_the_sign_of_the_softest_motions_is_that_in_double_precision(stiffness):
    """Shifted by multiples of its diagonal about where the first motions lose their stiffness.

    Its softest motions have 2e-8 of the diagonal's stiffness, less than single precision tells apart.
    """
    matrix, _ = stiffness
    diagonal = sparse.diags(matrix.diagonal())
    mixed, double = MixedSolver(), PardisoSolver()
    alone, counted, expected = [], [], []
    for shift in [1e-9, *np.geomspace(1e-8, 1e-7, 25), 1e-6]:
        shifted = (matrix - shift * diagonal).tocsr()
        expected.append(double.factorise(shifted, 0))
        counted.append(mixed.factorise(shifted, 0))
        alone.append(mixed._factors.factorise(shifted, shifted.diagonal(), 0))
    assert min(expected) == 0
    assert max(expected) == 4
    assert alone != expected
    assert counted == expected
