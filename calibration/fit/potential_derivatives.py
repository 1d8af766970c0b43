"""Gradient and Hessian of a section potential in (u, p), which a fit compares with those of the states.

For a network of ridges they are explicit matrix products over its images. Automatic differentiation of the
law, which is written for a kernel of scalars, takes ten times as long to compile and to run.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel import RidgeNetwork, SectionLaw

UPPER = np.triu_indices(6)  # second derivatives are listed in this order


def gradient_and_hessian(law: SectionLaw, state: Float[Array, "6"]) -> Float[Array, "27"]:
    """Return the first derivatives of Π by (u, p), then the upper triangle of the second by rows [SI].

    Parameters
    ----------
    law : law of the section.
    state : curvature [1/m] and pressures [Pa].
    """
    if isinstance(law, RidgeNetwork):
        gradient, hessian = _of_ridges(law, state)
    else:

        def potential(y: Array) -> Array:
            return law.potential(y[:3], y[3:])

        gradient, hessian = jax.grad(potential)(state), jax.hessian(potential)(state)
    return jnp.concatenate([gradient, hessian[UPPER]])


def _of_ridges(law: RidgeNetwork, state: Float[Array, "6"]) -> tuple[Float[Array, "6"], Float[Array, "6 6"]]:
    """Apply the chain rule in the notation of `RidgeNetwork`; i counts images, j ridges, f hidden functions.

    With z the arguments of the ridges, whose slopes in (x, q) are A, and t = tanh(W q + w):

        ∇F = Σ_j c_j φ'(z_j) A_j + (L Lᵀ x, v_q + Wᵀ (v_t t'))
        ∇²F = Σ_j c_j φ''(z_j) A_j ⊗ A_j + (L Lᵀ, Wᵀ diag(l t'') W),    l = Σ_j c_j φ'(z_j) e_j + v_t
    """
    images = _images(law).astype(state.dtype)
    scaled = images @ state
    x, q = scaled[:, :3], scaled[:, 3:]
    into = law.feature_weights
    biases = jnp.broadcast_to(law.feature_biases, (len(images), len(into)))
    hidden, at_rest = jnp.tanh(q @ into.T + biases), jnp.tanh(biases)
    by_pressure, by_hidden = law.mixing[:, :3], law.mixing[:, 3:]
    z = x @ law.directions.T + q @ by_pressure.T + hidden @ by_hidden.T + law.offsets
    z_rest = at_rest @ by_hidden.T + law.offsets

    flatness = 1.0 / (1.0 + z * z)
    lift = law.weights * flatness**2  # c φ'
    bend = -4.0 * z * flatness * lift  # c φ''
    lift_rest = law.weights * (1.0 + z_rest * z_rest) ** -2
    lower = jnp.zeros((3, 3), law.factor.dtype).at[np.tril_indices(3)].set(law.factor)
    stiffness = lower @ lower.T
    hidden_slope = 1.0 - hidden * hidden
    hidden_bend = -2.0 * hidden * hidden_slope
    load = lift @ by_hidden + law.slopes[3:]

    of_curvature = jnp.broadcast_to(law.directions, (len(images), *law.directions.shape))
    of_pressure = by_pressure + jnp.einsum("jf,if,fk->ijk", by_hidden, hidden_slope, into)
    slopes = jnp.concatenate([of_curvature, of_pressure], axis=2)
    smooth = (
        x @ stiffness - lift_rest @ law.directions,
        law.slopes[:3] + (law.slopes[3:] * hidden_slope) @ into,
    )
    gradient = jnp.einsum("ij,ija->ia", lift, slopes) + jnp.concatenate(smooth, axis=1)
    hessian = jnp.einsum("ija,ij,ijb->iab", slopes, bend, slopes)
    hessian = hessian.at[:, :3, :3].add(stiffness)
    hessian = hessian.at[:, 3:, 3:].add(jnp.einsum("if,fa,fb->iab", load * hidden_bend, into, into))

    share = law.energy_scale / len(images)
    first = share * jnp.einsum("ia,iab->b", gradient, images)
    second = share * jnp.einsum("iab,iac,icd->bd", images, hessian, images)
    return first.at[3:].add(-law.rest_volume), second


def _images(law: RidgeNetwork) -> Float[Array, "images 6 6"]:
    """Return the matrices from (u, p) to the scaled (x, q) of each image."""
    into = np.zeros((len(law.images), 6, 6))
    for number, (turn, order) in enumerate(law.images):
        into[number, :3, :3] = turn
        into[number, 3:, 3:] = np.eye(3)[order]
    scales = jnp.repeat(jnp.array([law.curvature_scale, law.pressure_scale]), 3)
    return jnp.asarray(into) / scales[:, None]
