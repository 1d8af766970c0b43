"""One network for the section laws of all orientations ψ of a double helix."""

from dataclasses import replace
from typing import final

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from rodmodel.io import SIGNS, TURNS
from rodmodel.section._ridge_network import RidgeNetwork


@final
class OrientedNetwork(eqx.Module):
    """Ridge network whose hidden features depend on the pressures and on ψ.

    A turn by 120° or a mirror maps a double helix at ψ to one at another orientation. With U and M the maps
    of the curvature, S and S' those of the pressures,

        Π(u, p; ψ) = Π(U u, S p; ψ − 120°) = Π(M u, S' p; −ψ),

    and the threads cross at both ψ and ψ + 180°. All of this holds exactly, as the network is the mean over
    these images, and takes ψ as cos 2ψ and sin 2ψ,

        h(q, ψ) = (q, tanh(W q + V (cos 2ψ, sin 2ψ) + w)).

    Attributes
    ----------
    network : network of full symmetry with W and w.
    orientation_weights : V, (features, 2).
    """

    network: RidgeNetwork
    orientation_weights: Float[Array, "_ 2"]

    def __check_init__(self) -> None:
        """Refuse weights that do not fit the network."""
        if self.network.symmetry != "full" or self.network.feature_biases.ndim != 1:
            raise ValueError("network: got a law of a single orientation, expected full symmetry and one w")
        expected = (len(self.network.feature_biases), 2)
        if self.orientation_weights.shape != expected:
            raise ValueError(
                f"orientation_weights: got shape {self.orientation_weights.shape}, expected {expected}"
            )

    def at_psi(self, psi: Float[ArrayLike, ""]) -> RidgeNetwork:
        """Return the section law of the winding at ψ [rad], differentiable by it."""
        dtype = self.orientation_weights.dtype
        twice = 2.0 * jnp.asarray(SIGNS, dtype) * (psi - jnp.asarray(TURNS, dtype))
        harmonics = jnp.stack([jnp.cos(twice), jnp.sin(twice)], axis=1)
        biases = self.network.feature_biases + harmonics @ self.orientation_weights.T
        return replace(self.network, feature_biases=biases)
