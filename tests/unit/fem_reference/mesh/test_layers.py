"""Layers of a cell: as many from crossing to crossing, or from ring to ring, and no crossing within one."""

import dataclasses

import numpy as np
import pytest

from fem_reference import LEVELS, ActuatorGeometry, DoubleHelix, NoWinding, Ring, SixHelix
from fem_reference.mesh import MeshLevel, body_mesh
from tests.fem_fixtures import TINY

GEOMETRY = ActuatorGeometry()
WINDINGS = [
    DoubleHelix(),
    *(DoubleHelix(pitch=pitch) for pitch in (2e-3, 2.3e-3, 4e-3, 6e-3)),
    Ring(),
    Ring(spacing=1.1e-3),
    SixHelix(),
    NoWinding(),
]


def heights(winding, level: MeshLevel) -> np.ndarray:
    """Where the layers of the winding's cell meet [mm]; the section's counts do not matter."""
    flat = dataclasses.replace(TINY, axial_size=level.axial_size, order=level.order)
    length = winding.cell_length(GEOMETRY.body_diameter)
    mesh = body_mesh(GEOMETRY, length, flat, min(winding.interval, length))
    return np.unique(np.round(mesh.points[:, 2], 9))[:: level.order]


@pytest.mark.parametrize("winding", WINDINGS, ids=repr)
@pytest.mark.parametrize("name", LEVELS)
def test_every_interval_has_the_same_whole_number_of_layers(winding, name):
    level = LEVELS[name]
    found = heights(winding, level)
    layers = len(found) - 1
    length = winding.cell_length(GEOMETRY.body_diameter)
    np.testing.assert_allclose(np.diff(found), 1e3 * length / layers, rtol=1e-8)
    intervals = max(1, round(length / winding.interval))
    assert layers % intervals == 0
    # Two crossings, or both sides of a ring, are held alike.
    assert layers % 2 == 0
    assert layers >= 2 * intervals
    assert found[1] <= level.axial_size * (1.0 + 1e-9)


def test_layers_are_no_shorter_than_the_rule_wants():
    coarse, quadratic = LEVELS["coarse"], LEVELS["quadratic"]
    expected = {DoubleHelix(): (6, 4), DoubleHelix(pitch=4e-3): (8, 6), Ring(): (4, 2), SixHelix(): (4, 4)}
    for winding, counts in expected.items():
        assert tuple(len(heights(winding, level)) - 1 for level in (coarse, quadratic)) == counts
