"""The two symmetric solvers agree, tell what they cannot do, and replace each other with a message."""

import logging
import sys

import numpy as np
import pytest
import scipy.sparse as sparse

from fem_reference.algebra import SingularMatrixError, SparsePattern, default_solver
from fem_reference.algebra.factorisation import PardisoSolver, SuperLuSolver

SIZE, NEGATIVE = 60, 7


def indefinite(seed: int = 0) -> np.ndarray:
    """Sparse symmetric matrix with seven negative eigenvalues and a condition number below 100.

    Diagonally dominant: couplings of at most 0.4, two in a row, beside a diagonal of at least 2 in magnitude,
    so that the diagonal's signs are the inertia's. The unknowns are shuffled.
    """
    rng = np.random.default_rng(seed)
    matrix = np.diag(rng.uniform(2.0, 5.0, SIZE))
    matrix[np.arange(NEGATIVE), np.arange(NEGATIVE)] *= -1.0
    for i in range(0, SIZE - 2, 2):
        matrix[i, i + 1] = matrix[i + 1, i] = matrix[i, i + 2] = matrix[i + 2, i] = rng.uniform(-0.4, 0.4)
    order = rng.permutation(SIZE)
    return matrix[np.ix_(order, order)]


def upper(matrix: np.ndarray) -> sparse.csr_matrix:
    return sparse.csr_matrix(sparse.triu(sparse.csr_matrix(matrix)))


@pytest.fixture(params=[PardisoSolver, SuperLuSolver])
def solver(request):
    return request.param()


def test_solutions_satisfy_the_equations_and_both_solvers_agree(solver):
    matrix = indefinite()
    right = np.random.default_rng(1).uniform(-1.0, 1.0, (SIZE, 4))
    solver.factorise(upper(matrix), 0)
    # Round-off times a condition number below 100.
    np.testing.assert_allclose(solver.solve(right), np.linalg.solve(matrix, right), rtol=0, atol=1e-13)


def test_right_sides_need_not_be_of_double_precision(solver):
    matrix, right = indefinite(), np.arange(SIZE, dtype=np.float32)[:, None]
    solver.factorise(upper(matrix), 0)
    # Round-off of values up to 59 times a condition number below 100.
    np.testing.assert_allclose(matrix @ solver.solve(right), right, rtol=0, atol=1e-11)


def test_a_new_matrix_of_the_same_pattern_replaces_the_factors(solver):
    right = np.ones((SIZE, 1))
    solver.factorise(upper(indefinite()), 0)
    solver.solve(right)
    changed = indefinite() * 2.0 + 3.0 * np.eye(SIZE)
    solver.factorise(upper(changed), 0)
    np.testing.assert_allclose(solver.solve(right), np.linalg.solve(changed, right), rtol=0, atol=1e-13)


def test_a_new_pattern_replaces_the_old(solver):
    right = np.ones((SIZE, 1))
    for revision, seed in enumerate((0, 5)):
        solver.factorise(upper(indefinite(seed)), revision)
        expected = np.linalg.solve(indefinite(seed), right)
        np.testing.assert_allclose(solver.solve(right), expected, rtol=0, atol=1e-13)


def test_one_solver_serves_the_matrices_of_two_cells(solver):
    """Patterns of the same size, as two cells of one mesh level have, but of different layout."""
    right = np.ones((SIZE, 1))
    for offset, values in ((1, 0.4), (7, -0.3)):
        chain = np.column_stack([np.arange(SIZE - offset), np.arange(offset, SIZE)])
        pattern = SparsePattern(SIZE, {"chain": chain}, (np.array([0]), np.array([0])))
        data = np.zeros(len(pattern))
        pattern.add_group(data, "chain", np.full((len(chain), 2, 2), values))
        data[pattern.diagonal] += 2.0
        matrix = pattern.matrix(data)
        full = (matrix + sparse.triu(matrix, 1).T).toarray()
        solver.factorise(matrix, pattern.revision)
        np.testing.assert_allclose(solver.solve(right), np.linalg.solve(full, right), rtol=0, atol=1e-13)


def test_pardiso_counts_the_negative_eigenvalues():
    assert np.sum(np.linalg.eigvalsh(indefinite()) < 0.0) == NEGATIVE
    assert PardisoSolver().factorise(upper(indefinite()), 0) == NEGATIVE


def test_a_zero_on_the_diagonal_is_no_obstacle(solver):
    """A constraint's row, as the gauges without compliance would have."""
    matrix = np.array([[2.0, 0.0, 1.0], [0.0, 3.0, -1.0], [1.0, -1.0, 0.0]])
    with_zero = sparse.csr_matrix(
        (np.array([2.0, 1.0, 3.0, -1.0, 0.0]), np.array([0, 2, 1, 2, 2]), np.array([0, 2, 4, 5])),
        shape=(3, 3),
    )
    right = np.array([[1.0], [2.0], [0.5]])
    solver.factorise(with_zero, 0)
    np.testing.assert_allclose(solver.solve(right), np.linalg.solve(matrix, right), rtol=0, atol=1e-13)


def test_a_singular_matrix_is_refused(solver):
    # A floating spring chain: rigid motion costs nothing, exactly so in floating point.
    chain = 2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    chain[0, 0] = chain[-1, -1] = 1.0
    with pytest.raises(SingularMatrixError):
        solver.factorise(upper(chain), 0)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_pardiso_refuses_a_matrix_that_is_not_finite(value):
    matrix = indefinite()
    matrix[3, 3] = value
    solver = PardisoSolver()

    def solve():
        solver.factorise(upper(matrix), 0)
        solver.solve(np.ones((SIZE, 1)))

    with pytest.raises(SingularMatrixError):
        solve()


def test_solving_before_factorising_says_so(solver):
    with pytest.raises(RuntimeError, match="before factorise"):
        solver.solve(np.ones((3, 1)))


def test_pardiso_is_the_default():
    assert isinstance(default_solver(), PardisoSolver)


def test_superlu_takes_over_with_a_message_where_mkl_is_missing(monkeypatch, caplog):
    # None in sys.modules makes the import raise ImportError.
    monkeypatch.setitem(sys.modules, "pypardiso", None)
    with caplog.at_level(logging.WARNING, logger="fem_reference.algebra.factorisation"):
        solver = default_solver()
    assert isinstance(solver, SuperLuSolver)
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    assert "PARDISO is not available" in record.message
    assert "SuperLU takes over" in record.message


def test_single_pivots_give_way_to_pairs_where_one_is_too_small():
    """A saddle with nothing on its diagonal has no single pivot at all; a definite matrix needs no pairs."""
    solver = PardisoSolver(definite=True)
    right = np.random.default_rng(2).uniform(-1.0, 1.0, (SIZE, 2))
    half = SIZE // 2
    saddle = np.kron(np.array([[0.0, 1.0], [1.0, 0.0]]), np.diag(np.linspace(1.0, 2.0, half)))
    definite = indefinite() @ indefinite().T + np.eye(SIZE)
    for revision, (matrix, negative) in enumerate([(definite, 0), (saddle, half), (indefinite(), NEGATIVE)]):
        assert solver.factorise(_with_diagonal(matrix), revision) == negative
        # Round-off times condition numbers below 1e4.
        np.testing.assert_allclose(solver.solve(right), np.linalg.solve(matrix, right), rtol=0, atol=1e-11)


def _with_diagonal(matrix: np.ndarray) -> sparse.csr_matrix:
    """Upper triangle in which the diagonal's zeros are stored, as PARDISO wants them."""
    rows, columns = np.nonzero(np.triu(matrix) + np.eye(SIZE))
    return sparse.csr_matrix((matrix[rows, columns], (rows, columns)), shape=matrix.shape)


def test_factors_of_single_precision_are_refined_to_double():
    solver, matrix = PardisoSolver(single=True), indefinite()
    # Columns whose squares single precision does not hold, and one of zeros.
    right = np.random.default_rng(3).uniform(-1.0, 1.0, (SIZE, 3)) * np.array([1e-30, 1e30, 0.0])
    expected = np.linalg.solve(matrix, right)
    assert solver.factorise(upper(matrix), 0) == NEGATIVE
    size = np.maximum(np.abs(expected).max(axis=0), 1.0e-300)
    # The residual it is refined to, 1e-7 of the right side, times a condition number below 100.
    np.testing.assert_allclose(solver.solve(right) / size, expected / size, rtol=0, atol=1e-5)


@pytest.mark.parametrize(("stiff", "soft"), [(1e10, 1.0), (1e7, 0.7)])
def test_a_matrix_beyond_single_precision_is_factorised_in_double(stiff, soft):
    """A stiff spring on a soft one, which single precision loses, or takes for one of 1.0 in place of 0.7."""
    matrix = np.eye(SIZE)
    matrix[:2, :2] = stiff * np.array([[1.0, -1.0], [-1.0, 1.0]]) + np.diag([0.0, soft])
    solver = PardisoSolver(definite=True, single=True)
    right = np.random.default_rng(4).uniform(1.0, 2.0, (SIZE, 1))
    for revision, tried in enumerate([matrix, indefinite(), matrix]):
        solver.factorise(upper(tried), revision)
        found = solver.solve(right)
        # Double's round-off times a condition number of 4e10; else what a refined solution may leave.
        left = np.linalg.norm(tried @ found - right) / np.linalg.norm(right)
        assert left < (1e-5 if tried is matrix else 1e-7)
