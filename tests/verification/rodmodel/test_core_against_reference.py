"""The compiled rod against the differentiable one: the same steps, so the same numbers, law by law."""

from typing import Any

import equinox as eqx
import jax
import numpy as np
import pytest

import rodmodel
from rodmodel import CoreRod, FixedStep, Rod
from rodmodel.core import Result

STEPS = 8
#: Layout, ψ and pitch of every calibration that ships; ψ = 0.4 rad is taken from the law of all.
LAWS = [
    ("double-helix", 0.0, 2e-3),
    ("double-helix", 0.0, 3e-3),
    ("double-helix", 0.0, 4e-3),
    ("double-helix", 0.0, 6e-3),
    ("double-helix", np.deg2rad(12.0), 3e-3),
    ("double-helix", np.deg2rad(90.0), 3e-3),
    ("double-helix", 0.4, 3e-3),
    ("ring", 0.0, 3e-3),
    ("six-helix", 0.0, 3e-3),
]
FAST = LAWS[1]


def cases(rod: CoreRod, count: int) -> dict[str, np.ndarray]:
    """Pressures in the domain, and loads of all kinds that bend the rod by some ten degrees."""
    random = np.random.default_rng(11)
    pressure = random.uniform(size=(6 * count, 3)) * np.array(rod.domain.pressure_max)
    pressure = pressure[rod.domain.covers_pressure(pressure.T)][:count]

    def vectors(size: float) -> np.ndarray:
        directions = random.normal(size=(count, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        return size * random.uniform(size=(count, 1)) * directions

    return {
        "pressure": pressure,
        "tip_force": vectors(0.02),
        "tip_moment": vectors(5e-4),
        "gravity": vectors(9.81),
        "distributed_force": vectors(0.3),
        "follower_moment": vectors(2e-4),
        "follower_force": vectors(0.02),
        "base_position": vectors(1.0),
    }


@eqx.filter_jit
def reference(rod: Rod, given: dict[str, jax.Array]) -> dict[str, jax.Array]:
    def one(row: dict[str, jax.Array]) -> dict[str, jax.Array]:
        pressure = row.pop("pressure")
        solution = rod.solve(pressure, throw=False, solver=FixedStep(STEPS, 1e-12), **row)
        return {
            "tip_position": solution.tip_position,
            "tip_rotation": solution.tip_rotation,
            "bend": solution.bend,
            "chamber_volume": solution.chamber_volume,
            "converged": solution.converged,
            "stable": solution.stable,
            "in_domain": solution.in_domain,
        }

    # A few rows at a time, so that one that takes many load steps holds up no more than these.
    found: dict[str, jax.Array] = jax.lax.map(one, given, batch_size=20)
    return found


def compare(law: tuple[str, float, float], count: int, kinds: tuple[str, ...]) -> None:
    core, rod = rodmodel.load_core(*law), rodmodel.load(*law)
    given = {name: value for name, value in cases(core, count).items() if name in ("pressure", *kinds)}
    expected = {name: np.asarray(value) for name, value in reference(rod, given).items()}
    found = core.solve_many(steps=STEPS, tolerance=1e-12, volumes=True, threads=2, **given)
    both = (found["result"] == Result.successful) & expected["converged"]
    # At the edge of what the rod can carry, rounding decides where the last load step fails.
    assert np.mean((found["result"] == Result.successful) == expected["converged"]) >= 0.999
    assert np.mean(both) >= 0.99
    length = core.actuator.body_length
    for name, tolerance in {
        "tip_position": 1e-9 * length,
        "tip_rotation": 1e-8,
        "bend": 1e-8,
        "chamber_volume": 1e-9 * 9e-7,
    }.items():
        np.testing.assert_allclose(
            found[name][both], expected[name][both], rtol=0.0, atol=tolerance, err_msg=name
        )
    for name in ("stable", "in_domain"):
        assert np.mean((found[name][both] != 0) == expected[name][both]) >= 0.999, name


DEAD = ("tip_force", "tip_moment", "gravity", "distributed_force", "follower_moment", "base_position")


def test_the_core_is_the_reference_under_loads_of_all_kinds() -> None:
    compare(FAST, 60, DEAD)


# JAX compiles twice as many unknowns; `test_core_closed_forms.py` has the core under such a force, and
# `statics/test_steps.py` the integration in JAX.
@pytest.mark.slow
def test_the_core_is_the_reference_under_a_follower_force() -> None:
    compare(FAST, 60, ("follower_force", "gravity"))


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS, ids=str)
def test_the_core_is_the_reference_on_ten_thousand_states(law: tuple[str, float, float]) -> None:
    compare(law, 5000, DEAD)
    compare(law, 5000, ("follower_force", "gravity"))


BENT: dict[str, Any] = {
    "pressure": [30e3, 12e3, 4e3],
    "tip_force": [0.01, -0.02, 0.005],
    "tip_moment": [1e-4, 5e-5, -1e-4],
    "gravity": [0.0, 3.0, -9.81],
}
STRAIGHT = {name: [0.0, 0.0, 0.0] for name in BENT}


# Both run one program.
@pytest.mark.parametrize("given", [BENT, STRAIGHT], ids=["bent", "straight"])
def test_jacobians_are_those_of_the_reference(given: dict[str, Any]) -> None:
    """Both are of order 4 in the steps, in other ways: at 64 they differ by 1e-7 of the largest entry.
    Angle and plane have no derivative where the rod is straight, in either."""
    core, rod = rodmodel.load_core("double-helix"), rodmodel.load("double-helix")
    s = np.array([0.02, 0.05])
    _, found = core.jacobian(**given, arc_lengths=s, steps=128)
    _, expected = rod.jacobian(**given, arc_lengths=s, solver=FixedStep(128, 1e-12))
    for name in BENT:
        by = getattr(expected, name)
        for part in ("tip_position", "tip_turn", "bend", "positions", "turns"):
            value = np.asarray(getattr(by, part))
            assert np.all(np.isfinite(value))
            np.testing.assert_allclose(
                getattr(found, part)[name],
                value,
                rtol=0.0,
                atol=1e-7 * np.abs(value).max(),
                err_msg=f"{part} {name}",
            )
        for part in ("bending_angle", "bending_plane"):
            value = np.asarray(getattr(by, part))
            assert np.all(np.isnan(value) if given is STRAIGHT else np.isfinite(value))
            np.testing.assert_allclose(
                getattr(found, part)[name],
                value,
                rtol=0.0,
                atol=1e-7 * np.abs(np.nan_to_num(value)).max(),
                err_msg=f"{part} {name}",
            )
