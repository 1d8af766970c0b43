"""The calibrated section law: ridge functions of the curvature whose offsets depend on the pressures."""

import math
from typing import final

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel.actuator import Number
from rodmodel.io import IMAGES, images_of
from rodmodel.section._law import SectionLaw
from rodmodel.section._ridge_law import RidgeLaw, ridge, ridge_slope

#: U and order of the images (U u, p[order]) of a state at which the potential is the same, by symmetry.
SYMMETRIES = {symmetry: images_of(symmetry) for symmetry in IMAGES}


@final
class RidgeNetwork(SectionLaw):
    """Network of one hidden layer in the curvature, whose offsets are a network of the pressures.

        Π(u, p) = −V₀ Σ (p − p₀)_k + E mean over images [F(x, q) − F(0, q₀) − ∂F/∂x(0, q₀)·x] + ½ E xᵀ A₀ x
        F(x, q) = ½ |Lᵀ x|² + Σ_j c_j φ(d_j·x + e_j·h(q) + b_j) + v·h(q)
        h(q) = (q, tanh(W q + w)),    x = u/u_s,    q = p/p_s,    φ'(z) = (1 + z²)⁻²

    The mean is over the images of the state under the section's symmetry. At one pressure this is a sum of
    ridges of the curvature alone (see `RidgeLaw`), with which a rod is integrated. Potential and moment
    vanish at rest, at the pressures p₀ = q₀ p_s. The free curvature is the root of the moment near a guess
    that is linear in h, G (h(q) − h(q₀)). Only a law adjusted to an individual actuator, which has no
    symmetry, has q₀ and A₀ (see `rodmodel.io.adjusted`); in others they are zero.

    Attributes
    ----------
    feature_weights, feature_biases : W and w; each image may have its own w, (images, features).
    directions, mixing, offsets, weights : d, e, b and c.
    factor : lower triangle of L by rows, entries 11, 21, 22, 31, 32, 33. Far from all ridges the section has
        the stiffness L Lᵀ, and is stable.
    slopes : v.
    guess : G/u_s.
    pressure_scale : p_s [Pa].
    curvature_scale : u_s [1/m].
    energy_scale : E [J/m].
    rest_volume : V₀, chamber volume per length at rest [m²], apart from the part of F.
    symmetry : symmetry of the section: ``none``; ``mirror``, y → −y, as at ψ = 0; ``full``, with 120° turns
        too, as for rings.
    rest_pressures : q₀, (3,), or None for zeros.
    quadratic : lower triangle of A₀ by rows, or None for zeros.
    """

    feature_weights: Float[Array, "_ _"]
    feature_biases: Float[Array, " _"] | Float[Array, "_ _"]
    directions: Float[Array, "_ _"]
    mixing: Float[Array, "_ _"]
    offsets: Float[Array, " _"]
    weights: Float[Array, " _"]
    factor: Float[Array, " _"]
    slopes: Float[Array, " _"]
    guess: Float[Array, "_ _"]
    pressure_scale: Number
    curvature_scale: Number
    energy_scale: Number
    rest_volume: Number
    symmetry: str = eqx.field(static=True, default="none")
    rest_pressures: Float[Array, " _"] | None = None
    quadratic: Float[Array, " _"] | None = None

    def __check_init__(self) -> None:
        """Refuse arrays that do not fit together, an unknown symmetry, and impossible scales."""
        features, ridges = self.feature_biases.shape[-1], self.offsets.shape[0]
        expected = {
            "feature_weights": (features, 3),
            "directions": (ridges, 3),
            "mixing": (ridges, 3 + features),
            "weights": (ridges,),
            "factor": (6,),
            "slopes": (3 + features,),
            "guess": (3, 3 + features),
            "rest_pressures": (3,),
            "quadratic": (6,),
        }
        for name, shape in expected.items():
            if getattr(self, name) is not None and getattr(self, name).shape != shape:
                raise ValueError(
                    f"{name}: got shape {getattr(self, name).shape}, expected {shape} with {features} "
                    f"features and {ridges} ridges"
                )
        if self.symmetry not in SYMMETRIES:
            raise ValueError(f"symmetry: got {self.symmetry!r}, expected one of {', '.join(SYMMETRIES)}")
        if self.symmetry != "none" and not (self.rest_pressures is None and self.quadratic is None):
            raise ValueError(f"symmetry: got {self.symmetry!r}, expected none in an adjusted law")
        if self.feature_biases.ndim == 2 and len(self.feature_biases) != len(self.images):
            raise ValueError(
                f"feature_biases: got {len(self.feature_biases)} rows, expected one, or {len(self.images)}: "
                "one for each image"
            )
        for name in ("pressure_scale", "curvature_scale", "energy_scale", "rest_volume"):
            value = getattr(self, name)
            if isinstance(value, float | int) and not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name}: got {value}, expected a positive number")

    @property
    def images(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """U and order of the images (U u, p[order]) of a state under the symmetry, itself included."""
        return SYMMETRIES[self.symmetry]

    def at(self, pressure: Float[Array, "3"]) -> RidgeLaw:
        """Contract the law to a function of the curvature."""
        return self.contracted(pressure).settled()

    def contracted(self, pressure: Float[Array, "3"]) -> RidgeLaw:
        """Contract the law, with the guess as free curvature."""
        turns = jnp.asarray(np.stack([turn for turn, _ in self.images]), self.offsets.dtype)
        orders = np.stack([order for _, order in self.images])
        share = 1.0 / len(orders)
        scaled = pressure[orders] / self.pressure_scale
        straight = jnp.zeros_like(scaled) if self.rest_pressures is None else self.rest_pressures[orders]
        inputs, rest = self.features(scaled), self.features(straight)
        change = inputs - rest
        mixed, at_rest = inputs @ self.mixing.T + self.offsets, rest @ self.mixing.T + self.offsets
        # Directions of each image in the axes of the section, (images, ridges, 3).
        directions = jnp.einsum("jk,ikl->ijl", self.directions, turns)
        lower = jnp.zeros((3, 3), self.factor.dtype).at[np.tril_indices(3)].set(self.factor)
        turned = jnp.swapaxes(turns, 1, 2) @ lower
        quadratic = share * jnp.einsum("ikm,ilm->kl", turned, turned)
        if self.quadratic is not None:
            half = jnp.zeros((3, 3), lower.dtype).at[np.tril_indices(3)].set(self.quadratic)
            quadratic += half + half.T - jnp.diag(jnp.diag(half))
        free = jnp.einsum("kn,in,ikl->l", self.guess, change, turns)
        value = jnp.sum(change @ self.slopes) - jnp.sum(ridge(at_rest) @ self.weights)
        return RidgeLaw(
            free_curvature=self.curvature_scale * share * free,
            constant=share * value
            - self.rest_volume / self.energy_scale * jnp.sum(pressure - self.pressure_scale * straight[0]),
            slope=-share * jnp.einsum("j,ij,ijl->l", self.weights, ridge_slope(at_rest), directions),
            quadratic=quadratic,
            directions=directions.reshape(-1, 3),
            offsets=mixed.ravel(),
            weights=jnp.tile(share * self.weights, len(orders)),
            energy_scale=self.energy_scale,
            curvature_scale=self.curvature_scale,
        )

    def features(self, inputs: Float[Array, "images 3"]) -> Float[Array, "images inputs"]:
        """Return the features h(q) for the scaled pressures q of each image."""
        hidden = jnp.tanh(inputs @ self.feature_weights.T + self.feature_biases)
        return jnp.concatenate([inputs, hidden], axis=1)
