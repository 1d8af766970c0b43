"""Ridge networks of less symmetry: the same potential, with images written out as more ridges."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel.section._ridge_network import SYMMETRIES, RidgeNetwork

# Indices of the entries of a triangular factor.
_ROWS, _COLUMNS = np.tril_indices(3)


def unfolded(law: RidgeNetwork, symmetry: str = "none") -> RidgeNetwork:
    """Return the same potential as a network of less symmetry.

    The lesser symmetry is a subgroup, which divides the images into cosets. The mean of F over all images is
    the mean, over the images of the lesser symmetry, of the mean over one image F(U x, q[order]) of every
    coset. The inner mean is a network again, with the ridges and features of these images.

    Parameters
    ----------
    law : network to expand; its images share their biases w, unless all of them are written out.
    symmetry : a part of the law's own symmetry: ``full``, ``mirror`` or ``none``.

    Raises
    ------
    ValueError
        For a symmetry that is no part of the law's, or that keeps images with different biases.
    """
    kept = [order for _, order in SYMMETRIES.get(symmetry, [])]
    if not kept or not {tuple(order) for order in kept} <= {tuple(order) for _, order in law.images}:
        raise ValueError(f"symmetry: got {symmetry!r}, expected a part of the law's own, {law.symmetry!r}")
    if law.feature_biases.ndim == 2 and len(kept) > 1:
        raise ValueError(f"symmetry: got {symmetry!r}, expected 'none' for a law with biases for each image")
    biases = jnp.broadcast_to(law.feature_biases, (len(law.images), law.feature_biases.shape[-1]))
    parts, covered = [], set()
    for own, (turn, order) in zip(biases, law.images, strict=True):
        if tuple(order) not in covered:
            parts.append(transformed(replace(law, feature_biases=own, symmetry="none"), turn, order))
            covered |= {tuple(other[order]) for other in kept}
    share = 1.0 / len(parts)
    ridges = [part.mixing[:, 3:] for part in parts]
    own = jnp.zeros((len(parts) * ridges[0].shape[0], len(parts) * ridges[0].shape[1]), biases.dtype)
    for image, block in enumerate(ridges):
        height, width = block.shape
        own = own.at[image * height : (image + 1) * height, image * width : (image + 1) * width].set(block)
    stiffness = jnp.sum(jnp.stack([_square(part.factor) for part in parts]), axis=0)
    return replace(
        parts[0],
        feature_weights=jnp.concatenate([part.feature_weights for part in parts]),
        feature_biases=jnp.concatenate([part.feature_biases for part in parts]),
        directions=jnp.concatenate([part.directions for part in parts]),
        mixing=jnp.concatenate([jnp.concatenate([part.mixing[:, :3] for part in parts]), own], axis=1),
        offsets=jnp.concatenate([part.offsets for part in parts]),
        weights=share * jnp.concatenate([part.weights for part in parts]),
        factor=_factor(share * stiffness),
        slopes=share * _of_all([part.slopes for part in parts]),
        guess=share * _of_all([part.guess for part in parts]),
        symmetry=symmetry,
    )


def transformed(law: RidgeNetwork, turn: np.ndarray, order: np.ndarray) -> RidgeNetwork:
    """Return the law Π(U u, p[order]) for a network Π without symmetry."""
    axes = jnp.asarray(turn, law.offsets.dtype)
    back = np.argsort(order)  # e · p[order] = e[back] · p

    def renumbered(factors: Array) -> Array:
        return jnp.concatenate([factors[..., back], factors[..., 3:]], axis=-1)

    if law.rest_pressures is not None:
        law = replace(law, rest_pressures=law.rest_pressures[back])
    if law.quadratic is not None:
        law = replace(law, quadratic=(axes.T @ _symmetric(law.quadratic) @ axes)[_ROWS, _COLUMNS])
    return replace(
        law,
        feature_weights=law.feature_weights[:, back],
        directions=law.directions @ axes,
        mixing=renumbered(law.mixing),
        factor=_factor(axes.T @ _square(law.factor) @ axes),
        slopes=renumbered(law.slopes),
        guess=axes.T @ renumbered(law.guess),
    )


def _of_all(parts: list[Float[Array, "*n h"]]) -> Float[Array, "*n g"]:
    """Combine the factors of (q, hidden) of each image into those of (q, hidden of all images)."""
    return jnp.concatenate(
        [sum(part[..., :3] for part in parts), *(part[..., 3:] for part in parts)], axis=-1
    )


def _square(factor: Float[Array, "6"]) -> Float[Array, "3 3"]:
    lower = jnp.zeros((3, 3), factor.dtype).at[_ROWS, _COLUMNS].set(factor)
    return lower @ lower.T


def _symmetric(triangle: Float[Array, "6"]) -> Float[Array, "3 3"]:
    lower = jnp.zeros((3, 3), triangle.dtype).at[_ROWS, _COLUMNS].set(triangle)
    return lower + lower.T - jnp.diag(jnp.diag(lower))


def _factor(stiffness: Float[Array, "3 3"]) -> Float[Array, "6"]:
    return jnp.linalg.cholesky(stiffness)[_ROWS, _COLUMNS]
