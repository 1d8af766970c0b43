"""Sections in series: curvatures add up, and so do compliances."""

import numpy as np
import pytest

from calibration.fit import Samples
from calibration.snapped import in_series


def linear(seed: int, pressure: np.ndarray, moment: np.ndarray) -> Samples:
    """States of Π = u·K u/2 + u·B p + p·A p/2: m = K u + B p."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3, 3))
    stiffness = root @ root.T + np.eye(3)
    hessian = np.zeros((6, 6))
    hessian[:3, :3] = stiffness
    hessian[:3, 3:] = rng.standard_normal((3, 3))
    hessian[3:, :3] = hessian[:3, 3:].T
    hessian[3:, 3:] = -np.eye(3)
    curvature = np.linalg.solve(stiffness, (moment - pressure @ hessian[:3, 3:].T).T).T
    count = len(pressure)
    state = np.concatenate([curvature, pressure], axis=1)
    return Samples(
        pressure=pressure,
        curvature=curvature,
        energy=np.zeros(count),
        gradient=state @ hessian,
        hessian=np.broadcast_to(hessian, (count, 6, 6)),
        psi=np.zeros(count),
        path=np.array(["p"] * count),
        held_out=np.zeros(count, dtype=bool),
    )


@pytest.fixture
def pair() -> tuple[Samples, Samples]:
    rng = np.random.default_rng(9)
    pressure, moment = rng.random((5, 3)), rng.standard_normal((5, 3))
    return linear(1, pressure, moment), linear(2, pressure, moment)


def test_curvature_and_volume_are_means_at_the_same_moment(pair: tuple[Samples, Samples]) -> None:
    one, other = pair
    np.testing.assert_allclose(one.moment, other.moment, atol=1e-12)
    mixed = in_series(one, other, 0.25)
    np.testing.assert_allclose(mixed.moment, one.moment, atol=1e-12)
    np.testing.assert_allclose(mixed.curvature, 0.75 * one.curvature + 0.25 * other.curvature)
    np.testing.assert_allclose(mixed.volume, 0.75 * one.volume + 0.25 * other.volume)


def test_the_hessian_is_the_derivative_of_the_mixed_gradient(pair: tuple[Samples, Samples]) -> None:
    """Both laws are quadratic, so that the mixed one is too, and its Hessian maps states to gradients."""
    mixed = in_series(*pair, 0.4)
    state = np.concatenate([mixed.curvature, mixed.pressure], axis=1)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", mixed.hessian, state), mixed.gradient, atol=1e-10)
    np.testing.assert_allclose(mixed.hessian, np.swapaxes(mixed.hessian, 1, 2), atol=1e-12)


def test_no_share_and_the_whole_share_are_the_two_sections(pair: tuple[Samples, Samples]) -> None:
    for share, expected in zip((0.0, 1.0), pair, strict=True):
        mixed = in_series(*pair, share)
        np.testing.assert_allclose(mixed.hessian, expected.hessian, atol=1e-12)
        np.testing.assert_allclose(mixed.gradient, expected.gradient, atol=1e-12)


@pytest.mark.parametrize("share", [-0.1, 1.1, float("nan")])
def test_another_share_is_refused(pair: tuple[Samples, Samples], share: float) -> None:
    with pytest.raises(ValueError, match="share: got "):
        in_series(*pair, share)
