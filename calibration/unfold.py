"""One section's law written with less symmetry: where the fit of another winding may begin."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from rodmodel import OrientedNetwork, RidgeNetwork


def unfolded(law: RidgeNetwork, symmetry: str) -> RidgeNetwork:
    """The same potential from ridges of fewer images, more of them.

    The mean over all images of F is that over the symmetry's images of G(x, q) = mean_r F(U_r x, q[order_r]),
    r one of every set of images that the symmetry makes of each other; and G is a network again, of the
    ridges and hidden functions of all F(U_r ·). Its guess of the free curvature is zero.

    Parameters
    ----------
    law : of one orientation.
    symmetry : a part of the law's own, ``full``, ``mirror`` or ``none``.

    Raises
    ------
    ValueError
        Where the symmetry is no part of the law's.
    """
    kept = {tuple(order) for _, order in replace(law, symmetry=symmetry).images}
    if not kept <= {tuple(order) for _, order in law.images}:
        raise ValueError(f"symmetry: got {symmetry!r}, expected a part of the law's own, {law.symmetry!r}")
    chosen, covered = [], set()
    for turn, order in law.images:
        if tuple(order) not in covered:
            chosen.append((turn, order))
            covered |= {tuple(np.asarray(other)[order]) for other in kept}
    count, features = len(chosen), len(law.feature_biases)
    places = [np.argsort(order) for _, order in chosen]  # q[order] · e = q · e[places]
    mixing = np.zeros((count, len(law.offsets), 3 + count * features))
    for number, (block, place) in enumerate(zip(mixing, places, strict=True)):
        block[:, :3] = np.asarray(law.mixing)[:, place]
        hidden = 3 + number * features
        block[:, hidden : hidden + features] = law.mixing[:, 3:]
    factor = np.zeros((3, 3))
    factor[np.tril_indices(3)] = law.factor
    stiffness = np.mean([turn.T @ factor @ factor.T @ turn for turn, _ in chosen], axis=0)
    slopes = [np.mean([law.slopes[:3][place] for place in places], axis=0)]
    return replace(
        law,
        feature_weights=jnp.concatenate([law.feature_weights[:, place] for place in places]),
        feature_biases=jnp.tile(law.feature_biases, count),
        directions=jnp.concatenate([law.directions @ turn for turn, _ in chosen]),
        mixing=jnp.asarray(mixing.reshape(-1, mixing.shape[2])),
        offsets=jnp.tile(law.offsets, count),
        weights=jnp.tile(law.weights, count) / count,
        factor=jnp.asarray(np.linalg.cholesky(stiffness)[np.tril_indices(3)]),
        slopes=jnp.concatenate([*map(jnp.asarray, slopes), jnp.tile(law.slopes[3:], count) / count]),
        guess=jnp.zeros((3, mixing.shape[2])),
        symmetry=symmetry,
    )


def of_all_orientations(law: RidgeNetwork) -> OrientedNetwork:
    """A law of full symmetry as one of all orientations, the same at each of them."""
    return OrientedNetwork(law, jnp.zeros((len(law.feature_biases), 2)))
