"""Patch test of the contact between walls: two flat walls at one distance press on each other evenly.

The barrier sums pairs of points, edges and triangles, each with its share of the area, so that it passes the
test on refinement and not to rounding: a node's force errs with the few pairs around it.
"""

import numpy as np
import pytest
from jaxtyping import Float, Int

from fem_reference.walls import WallContact
from fem_reference.walls.self_contact import ACTIVATION

SIZE = 3.0  # mm


def wall(cells: int, height: float, upwards: bool) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "m 4"]]:
    """A square of quadrilaterals."""
    axis = np.linspace(0.0, SIZE, cells + 1)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1)
    quads = quads.reshape(-1, 4)
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, height)])
    return points, quads if upwards else quads[:, ::-1]


def pressures(cells: tuple[int, int], distance: float) -> tuple[list[np.ndarray], np.ndarray]:
    """Force over area of nodes away from the rim of either wall [MPa]; both resultants over the area."""
    (low, low_quads), (high, high_quads) = (
        wall(count, height, up)
        for count, height, up in zip(cells, (0.0, distance), (True, False), strict=True)
    )
    x = np.concatenate([low, high])
    walls = WallContact(x, np.concatenate([low_quads, len(low) + high_quads]))
    force = walls.force(x)
    parts = force[: len(low)], force[len(low) :]
    inner = []
    for points, part, count in zip((low, high), parts, cells, strict=True):
        away = (np.abs(points[:, :2] - 0.5 * SIZE) < 0.5 * SIZE - 0.55).all(axis=1)
        inner.append(np.abs(part[away, 2]) * (count / SIZE) ** 2)
    return inner, np.array([part.sum(axis=0) for part in parts]) / SIZE**2


def scatter(values: Float[np.ndarray, " n"]) -> float:
    """Standard deviation over the mean."""
    return float(values.std() / values.mean())


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_walls_whose_meshes_match_press_evenly(share):
    """To 5 %: the offsets that break ties turn some pairs of parallel edges."""
    inner, resultants = pressures((12, 12), share * ACTIVATION)
    for pressure in inner:
        assert scatter(pressure) < 0.05
    np.testing.assert_allclose(resultants[0], -resultants[1], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_walls_whose_meshes_do_not_match_press_more_evenly_the_finer_they_are(share):
    """And by up to a fifth more than those that match: so much of the barrier's stiffness is the pairs'.

    A tenth of that stiffness moves the bending angle at 60 kPa by 0.5 % (`fem_reference.walls.self_contact`).
    """
    found = [pressures(cells, share * ACTIVATION) for cells in ((6, 7), (12, 14), (24, 28))]
    matching, _ = pressures((12, 12), share * ACTIVATION)
    for side in (0, 1):
        coarse, middle, fine = (scatter(inner[side]) for inner, _ in found)
        assert 0.2 > coarse > middle > fine
        for inner, _ in found:
            assert 1.0 < inner[side].mean() / matching[side].mean() < 1.2
    for _, resultants in found:
        np.testing.assert_allclose(resultants[0], -resultants[1], rtol=1e-9, atol=1e-12)
