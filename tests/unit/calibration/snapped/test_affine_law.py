"""A sheet's law of constant stiffness: found from its own states, and the same as a network of ridges."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from calibration.fit import Samples
from calibration.fit.samples import metric
from calibration.snapped.affine_law import AffineLaw, as_network, fit_affine

LEAST = np.array([0.0, 50e3, 0.0])


def law(seed: int) -> AffineLaw:
    """About as stiff, as bent and as large as the paper's section."""
    rng = np.random.default_rng(seed)
    root = 1.2e-2 * (np.eye(3) + 0.2 * rng.standard_normal((3, 3)))
    volume = 1e-10 * rng.standard_normal((3, 3))
    return AffineLaw(
        centre=np.array([2e3, 60e3, 1e3]),
        stiffness=root @ root.T,
        free=np.array([40.0, 20.0, 1.0]) + rng.standard_normal(3),
        by_pressure=4e-4 * rng.standard_normal((3, 3)),
        volume=1.6e-5 * (1.0 + 0.3 * rng.standard_normal(3)),
        volume_by_pressure=volume + volume.T,
    )


def states(planted: AffineLaw, count: int, seed: int) -> Samples:
    """States at random curvatures and pressures of the sheet, by the law's own formula."""
    rng = np.random.default_rng(seed)
    pressure = LEAST + rng.uniform(0.0, [4e3, 20e3, 4e3], (count, 3))
    away = pressure - planted.centre
    free = planted.free + away @ planted.by_pressure.T
    curvature = free + rng.uniform(-5.0, 5.0, (count, 3))
    moment = (curvature - free) @ planted.stiffness
    volume = moment @ planted.by_pressure + planted.volume + away @ planted.volume_by_pressure
    hessian = np.empty((6, 6))
    hessian[:3, :3] = planted.stiffness
    hessian[:3, 3:] = -planted.stiffness @ planted.by_pressure
    hessian[3:, :3] = hessian[:3, 3:].T
    hessian[3:, 3:] = planted.by_pressure.T @ planted.stiffness @ planted.by_pressure
    hessian[3:, 3:] -= planted.volume_by_pressure
    return Samples(
        pressure=pressure,
        curvature=curvature,
        energy=np.zeros(count),
        gradient=np.concatenate([moment, -volume], axis=1),
        hessian=np.broadcast_to(hessian, (count, 6, 6)),
        psi=np.zeros(count),
        path=np.zeros(count, dtype=int),
        held_out=np.zeros(count, dtype=bool),
    )


@pytest.mark.parametrize("seed", range(3))
def test_the_law_of_exact_states_is_found(seed):
    """To rounding: the equations are linear."""
    planted = law(seed)
    some = states(planted, 30, seed)
    found = fit_affine(some, metric(some, 0.06, 4e3, 1e-3))
    np.testing.assert_allclose(
        found.stiffness, planted.stiffness, rtol=1e-8, atol=1e-10 * planted.stiffness.max()
    )
    np.testing.assert_allclose(found.by_pressure, planted.by_pressure, rtol=1e-6, atol=1e-11)
    there = found.free + found.by_pressure @ (planted.centre - found.centre)
    np.testing.assert_allclose(there, planted.free, rtol=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_a_network_of_ridges_is_the_same_law(seed):
    """To the share of a parabola that its ridge misses, some 1e-5, and of the feature, 1e-5 too."""
    planted = law(seed)
    made = as_network(planted, LEAST)
    for pressure, curvature, gradient, hessian in zip(
        *(
            getattr(states(planted, 8, 10 + seed), n)
            for n in ("pressure", "curvature", "gradient", "hessian")
        ),
        strict=True,
    ):
        p, u = jnp.asarray(pressure), jnp.asarray(curvature)
        free = planted.free + planted.by_pressure @ (pressure - planted.centre)
        np.testing.assert_allclose(made.free_curvature(p), free, atol=1e-4 * np.linalg.norm(free))
        size = np.linalg.norm(planted.stiffness @ free)
        np.testing.assert_allclose(made.at(p).moment(u), gradient[:3], atol=1e-4 * size)
        volume = -jax.grad(lambda q, v: made.at(q).energy(v))(p, u)
        np.testing.assert_allclose(volume, -gradient[3:], rtol=2e-3)
        np.testing.assert_allclose(
            made.at(p).stiffness(u), hessian[:3, :3], atol=1e-4 * planted.stiffness.max()
        )


def test_there_is_no_moment_at_rest_and_one_free_curvature_on_the_way():
    """A rod that is found from rest comes to the sheet by a way on which it is stable all along."""
    made = as_network(law(0), LEAST)
    np.testing.assert_allclose(made.at(jnp.zeros(3)).moment(jnp.zeros(3)), 0.0, atol=1e-12)
    for share in np.linspace(0.0, 1.0, 9):
        at = made.at(jnp.asarray(share * np.array([0.0, 60e3, 0.0])))
        assert np.all(np.isfinite(at.free_curvature))
        assert (
            np.linalg.eigvalsh(at.stiffness(at.free_curvature))[0]
            > 0.5 * np.linalg.eigvalsh(law(0).stiffness)[0]
        )


def test_states_of_a_section_that_gives_way_have_no_law():
    planted = law(1)
    some = states(planted, 30, 1)
    soft = some.hessian.copy()
    soft[:, :3, :3] -= 2.0 * np.linalg.eigvalsh(planted.stiffness)[0] * np.eye(3)
    scales = metric(some, 0.06, 4e3, 1e-3)
    with pytest.raises(ValueError, match="stiffness: got one that is not positive"):
        fit_affine(Samples(**{**vars(some), "hessian": soft, "gradient": 0.0 * some.gradient}), scales)
