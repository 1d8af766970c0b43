"""Errors are what they are called, on a law whose distance from the states is known."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from calibration.fit import Samples, deviations, figures
from calibration.fit.held_out_error import equilibrium
from rodmodel import CurvatureLaw, LinearLaw, SectionLaw

LENGTH = 0.06
STIFFNESS, TORSION = 2.5e-4, 2e-4


def linear_law(rest_volume=15e-6):
    """Π = −V₀ Σp + ½ B (u1² + u2²) + ½ T u3²."""
    return LinearLaw(jnp.diag(jnp.array([STIFFNESS, STIFFNESS, TORSION])), jnp.zeros((3, 3)), rest_volume)


class SofteningLaw(SectionLaw):
    """Π = ½ B a² log(1 + |u|²/a²), whose moment is B a/2 = 5e-3 N m at the most."""

    def at(self, pressure):
        return SofteningCurvatureLaw(0.0 * pressure)


class SofteningCurvatureLaw(CurvatureLaw):
    free_curvature: Float[Array, "3"]

    def energy(self, curvature):
        return 0.5 * STIFFNESS * 40.0**2 * jnp.log1p(curvature @ curvature / 40.0**2)

    def moment(self, curvature):
        return jax.grad(self.energy)(curvature)

    def stiffness(self, curvature):
        return jax.hessian(self.energy)(curvature)


@pytest.fixture
def states():
    """States of the linear law itself, half of them without moment."""
    rng = np.random.default_rng(0)
    n = 40
    moment = rng.uniform(-1e-3, 1e-3, (n, 3)) * (np.arange(n) % 2)[:, None]
    stiffness = np.diag([STIFFNESS, STIFFNESS, TORSION])
    hessian = np.zeros((n, 6, 6))
    hessian[:, :3, :3] = stiffness
    return Samples(
        pressure=rng.uniform(0, 4e4, (n, 3)),
        curvature=np.linalg.solve(stiffness, moment.T).T,
        energy=np.zeros(n),
        gradient=np.concatenate([moment, np.full((n, 3), -15e-6)], axis=1),
        hessian=hessian,
        psi=np.zeros(n),
        path=np.array(["a", "b"] * (n // 2)),
        held_out=np.ones(n, dtype=bool),
    )


def test_a_law_that_is_right_has_no_error(states):
    off = deviations(linear_law(), states, LENGTH)
    assert off.found.all()
    # The tolerance of the equilibrium, 1e-8 in curvature of the order of 1/m.
    assert np.abs(off.angle).max() < 1e-7 * LENGTH * 10
    assert np.abs(off.bend).max() < 1e-7 * LENGTH * 10
    assert np.abs(off.moment).max() < 1e-15
    assert np.abs(off.volume).max() < 1e-18


def test_a_state_bent_into_another_plane_has_an_error_of_plane_but_none_of_angle(states):
    turned = states.curvature @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    off = deviations(linear_law(), replace(states, curvature=turned), LENGTH)
    reach = LENGTH * np.linalg.norm(states.curvature[:, :2], axis=1)
    assert off.angle == pytest.approx(0.0, abs=1e-9)
    assert off.bend == pytest.approx(np.sqrt(2.0) * reach, abs=1e-9)


def test_errors_of_moment_and_volume_are_those_put_in(states):
    off = deviations(linear_law(rest_volume=15.3e-6), states, LENGTH)
    assert off.volume == pytest.approx(0.3e-6, rel=1e-9)
    gradient = states.gradient + np.array([3e-5, 4e-5, 0, 0, 0, 0])
    off = deviations(linear_law(), replace(states, gradient=gradient), LENGTH)
    assert off.moment == pytest.approx(5e-5, rel=1e-9)
    assert off.bend == pytest.approx(LENGTH * 5e-5 / STIFFNESS, rel=1e-6)


def test_figures_split_free_states_from_loaded_ones_and_say_where_the_worst_is(states):
    gradient = states.gradient.copy()
    gradient[7, 0] += 2e-4  # an odd state: one with a moment
    worst = replace(states, gradient=gradient)
    found = figures(linear_law(), worst, LENGTH)
    assert found["states"] == 40
    assert found["paths"] == 2
    assert found["free_bending_angle_rad"]["states"] == 20
    assert found["free_bending_angle_rad"]["worst"] < 1e-9
    loaded = found["loaded_bending_vector_rad"]
    assert loaded["worst"] == pytest.approx(LENGTH * 2e-4 / STIFFNESS, rel=1e-6)
    assert loaded["worst_at"]["pressure_pa"] == states.pressure[7].tolist()
    assert loaded["worst_at"]["moment_nm"] == gradient[7, :3].tolist()
    assert loaded["worst_at"]["path"] == "b"
    assert loaded["median"] < 1e-9
    assert found["moment_nm"]["worst"] == pytest.approx(2e-4, rel=1e-9)


def test_a_percentile_is_never_below_that_of_the_states(states):
    gradient = states.gradient.copy()
    gradient[:, 0] += np.where(np.arange(40) % 20 == 1, 1e-4, 0.0)  # one in twenty
    found = figures(linear_law(), replace(states, gradient=gradient), LENGTH)
    assert found["moment_nm"]["p95"] == pytest.approx(1e-4, rel=1e-9)


def test_a_law_without_equilibrium_counts_as_infinitely_far_off(states):
    gradient = states.gradient.copy()
    gradient[3, :3] = 1e-2
    found = figures(SofteningLaw(), replace(states, gradient=gradient), LENGTH)
    assert np.isinf(found["loaded_bending_angle_rad"]["worst"])
    assert np.isfinite(found["free_bending_angle_rad"]["worst"])


def test_equilibria_are_found_to_the_stated_tolerance(states):
    curvature, found = equilibrium(
        linear_law(),
        jnp.asarray(states.pressure),
        jnp.asarray(states.moment),
        jnp.zeros_like(states.moment),
        jnp.asarray(states.psi),
    )
    assert found.all()
    assert np.asarray(curvature) == pytest.approx(states.curvature, abs=1e-8 * 10)
