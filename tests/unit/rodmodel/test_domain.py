"""The domain of a law: which pressures are inside, and how its limits are told."""

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rodmodel.statics  # noqa: F401  # makes the domain known to JAX
from rodmodel import Domain


@pytest.mark.parametrize(
    ("unit", "plain", "limited"),
    [
        (
            "kPa",
            "70, 60, 60 kPa in chambers 1, 2, 3 and 100 kPa in sum",
            "70, 60, 60 kPa in chambers 1, 2, 3, 100 kPa in sum, "
            "and 79 kPa in each with 0.5 of the two others",
        ),
        (
            "Pa",
            "70000, 60000, 60000 Pa in chambers 1, 2, 3 and 100000 Pa in sum",
            "70000, 60000, 60000 Pa in chambers 1, 2, 3, 100000 Pa in sum, "
            "and 79000 Pa in each with 0.5 of the two others",
        ),
    ],
)
def test_the_largest_pressures_are_told_in_words(unit: str, plain: str, limited: str) -> None:
    domain = Domain((70e3, 60e3, 60e3), 100e3, 1e-3)
    assert domain.largest_pressures(unit) == plain
    assert dataclasses.replace(domain, beside_share=0.5, beside_max=79e3).largest_pressures(unit) == limited


def test_each_rod_of_a_stack_has_its_own_largest_pressures() -> None:
    stacked = jax.tree.map(lambda x: jnp.full(2, x), Domain((70e3, 60e3, 60e3), 100e3, 1e-3, 1e-3, 0.5, 79e3))
    told = stacked.largest_pressures("Pa")
    assert told.startswith("its largest, its largest, its largest Pa in chambers 1, 2, 3")
    assert "its largest Pa in each with its share of the two others; alone, with its least Pa in each" in told


def test_pressures_are_inside_where_all_limits_hold() -> None:
    """70 kPa alone, pairs of 50; at 60 kPa the other has 33.25."""
    domain = Domain((70e3, 70e3, 70e3), 105e3, 1e-3, beside_share=4.0 / 7.0, beside_max=79e3)
    inside = [[70e3, 0, 0], [50e3, 50e3, 0], [60e3, 33.2e3, 0], [0, 33.2e3, 60e3], [35e3, 35e3, 35e3]]
    outside = [[71e3, 0, 0], [51e3, 50.5e3, 0], [60e3, 33.3e3, 0], [60e3, 17e3, 17e3], [35.1e3, 35e3, 35e3]]
    assert np.all(domain.covers_pressure(np.array(inside).T))
    assert not np.any(domain.covers_pressure(np.array(outside).T))


def test_reach_scales_pressures_to_the_edge() -> None:
    domain = Domain((70e3, 65e3, 60e3), 105e3, 1e-3, beside_share=4.0 / 7.0, beside_max=79e3)
    for pressure in 100e3 * np.random.default_rng(0).random((200, 3)):
        edge = domain.reach(pressure) * pressure
        assert domain.covers_pressure(edge)
        assert not domain.covers_pressure(1.0001 * edge)
    assert domain.reach((0.0, 0.0, 0.0)) == np.inf


def test_rows_of_pressures_use_the_limits_as_each_does_alone() -> None:
    domain = Domain((70e3, 65e3, 60e3), 105e3, 1e-3, beside_share=4.0 / 7.0, beside_max=79e3)
    rows = 100e3 * np.random.default_rng(1).random((20, 3))
    each = [1.0 / domain.reach(row) for row in rows]
    np.testing.assert_allclose(domain.utilisation(rows.T), each, rtol=1e-14)
    # What a chamber may have alone leaves the shared limits as they are.
    alone = dataclasses.replace(domain, single_max=(80e3, 0.0, 0.0), single_beside=2e3)
    assert alone.utilisation((80e3, 0.0, 0.0)) == pytest.approx(80.0 / 70.0)
    assert alone.reach((80e3, 0.0, 0.0)) == 1.0


def test_a_least_pressure_bounds_from_below_and_is_told() -> None:
    domain = Domain((15e3, 70e3, 15e3), 100e3, 1e-3, pressure_min=(0.0, 53e3, 0.0))
    assert domain.covers_pressure((0.0, 53e3, 0.0))
    assert not domain.covers_pressure((0.0, 52.9e3, 0.0))
    assert "(at least 0, 53, 0 kPa)" in domain.largest_pressures("kPa")
    # Without one, a pressure that a gauge tells as slightly negative is inside.
    assert Domain((70e3, 60e3, 60e3), 100e3, 1e-3).covers_pressure((-1.0, 0.0, 0.0))


def test_a_chamber_alone_may_have_more_where_the_others_have_next_to_nothing() -> None:
    domain = Domain((57e3, 54e3, 54e3), 105e3, 1e-3, single_max=(70e3, 65e3, 0.0), single_beside=2e3)
    inside = [(70e3, 0.0, 0.0), (70e3, 2e3, 2e3), (0.0, 65e3, 1e3), (57e3, 20e3, 0.0), (0.0, 0.0, 54e3)]
    outside = [(70.1e3, 0.0, 0.0), (60e3, 2.1e3, 0.0), (0.0, 66e3, 0.0), (0.0, 0.0, 55e3), (58e3, 58e3, 0.0)]
    assert [bool(domain.covers_pressure(p)) for p in inside] == [True] * 5
    assert [bool(domain.covers_pressure(p)) for p in outside] == [False] * 5
    assert domain.reach((35e3, 0.0, 0.0)) == 2.0
    assert domain.reach((35e3, 0.5e3, 0.0)) == 2.0
    assert domain.reach((30e3, 10e3, 0.0)) == pytest.approx(57.0 / 30.0)
    assert domain.largest_pressures("kPa").endswith(
        "; alone, with 2 kPa in each of the others, up to 70, 65, 0 kPa"
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"pressure_max": (-1.0, 1.0, 1.0)}, "pressure_max: got -1, expected 0 or more"),
        ({"pressure_max": (1.0, 1.0)}, "pressure_max: got 2 numbers, expected three pressures"),
        ({"pressure_sum_max": math.nan}, "pressure_sum_max: got nan, expected 0 or more"),
        ({"moment_max": -1e-3}, "moment_max: got -0.001, expected 0 or more"),
        ({"single_max": (0.0, math.nan, 0.0)}, "single_max: got nan, expected 0 or more"),
    ],
)
def test_numbers_that_are_no_limits_are_refused(unchecked: None, change: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        dataclasses.replace(Domain((70e3, 60e3, 60e3), 100e3, 1e-3), **change)


def test_how_far_pressures_go_is_not_known_of_none() -> None:
    assert math.isnan(Domain((70e3, 60e3, 60e3), 100e3, 1e-3).reach((math.nan, 0.0, 0.0)))
