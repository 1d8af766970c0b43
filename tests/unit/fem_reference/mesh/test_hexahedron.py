"""Lagrange hexahedra: the order of their nodes, what they reproduce, their slopes, and the Gauss rule."""

import itertools

import numpy as np
import pytest

from fem_reference.mesh import reference_element
from fem_reference.mesh.hexahedron import ReferenceElement
from tests.fem_fixtures import difference

PLACES = np.random.default_rng(0).uniform(0.0, 1.0, (20, 3))
# Functions and places are of order one: what is left is round-off.
ROUND_OFF = 1e-13


@pytest.fixture(scope="module", params=[1, 2], ids=["linear", "quadratic"])
def element(request) -> ReferenceElement:
    return reference_element(request.param)


def nodes(element: ReferenceElement) -> np.ndarray:
    """Nodes in tensor order, x running fastest."""
    side = np.linspace(0.0, 1.0, element.order + 1)
    return np.array([(x, y, z) for z in side for y in side for x in side])


def monomials(degree: int) -> list[tuple[int, ...]]:
    """Exponents of x, y and z up to a degree in each."""
    return list(itertools.product(range(degree + 1), repeat=3))


def test_each_function_is_one_at_its_own_node_and_zero_at_the_others(element):
    values, _ = element.evaluate(nodes(element))
    assert element.nodes == (element.order + 1) ** 3
    np.testing.assert_allclose(values, np.eye(element.nodes), rtol=0, atol=ROUND_OFF)


def test_the_functions_add_up_to_one(element):
    values, gradients = element.evaluate(PLACES)
    np.testing.assert_allclose(values.sum(axis=1), 1.0, rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(gradients.sum(axis=1), 0.0, rtol=0, atol=ROUND_OFF)


def test_polynomials_of_the_elements_order_in_each_direction_are_reproduced(element):
    values, gradients = element.evaluate(PLACES)
    for powers in monomials(element.order):
        at_nodes = np.prod(nodes(element) ** powers, axis=1)
        np.testing.assert_allclose(values @ at_nodes, np.prod(PLACES**powers, axis=1), atol=ROUND_OFF)
        slope = [
            powers[i] * np.prod(PLACES ** np.maximum(powers - np.eye(3, dtype=int)[i], 0), axis=1)
            for i in range(3)
        ]
        found = np.einsum("pai,a->ip", gradients, at_nodes)
        np.testing.assert_allclose(found, slope, rtol=0, atol=ROUND_OFF)


def test_gradients_are_the_slopes_of_the_functions(element):
    _, gradients = element.evaluate(PLACES)
    for i, e in enumerate(np.eye(3)):
        # Quadratic at most along each axis, which the differences take exactly: only round-off is left.
        slope = difference(lambda t, e=e: element.evaluate(PLACES + t * e)[0], 0.1)
        np.testing.assert_allclose(gradients[:, :, i], slope, rtol=0, atol=ROUND_OFF)


def test_the_gauss_rule_is_exact_to_degree_2n_plus_1_in_each_direction(element):
    assert len(element.weights) == (element.order + 1) ** 3
    for powers in monomials(2 * element.order + 1):
        exact = 1.0 / np.prod(np.add(powers, 1.0))
        found = element.weights @ np.prod(element.points**powers, axis=1)
        assert found == pytest.approx(exact, rel=ROUND_OFF), powers
    beyond = element.weights @ element.points[:, 0] ** (2 * element.order + 2)
    assert beyond != pytest.approx(1.0 / (2 * element.order + 3), rel=1e-3)


def test_values_and_gradients_are_kept_at_the_gauss_points(element):
    values, gradients = element.evaluate(element.points)
    np.testing.assert_array_equal(element.values, values)
    np.testing.assert_array_equal(element.gradients, gradients)
