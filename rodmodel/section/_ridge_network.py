"""The section law that calibrations ship: ridge functions of the curvature that move with the pressures."""

import math
from typing import Any, final

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel._kernel import as_data
from rodmodel.section._law import SectionLaw
from rodmodel.section._ridges import RidgeLaw, powers, ridge, ridge_slope, turned_rows, weighted_sum
from rodmodel.section._turned import INTO_TURNED, MIRROR, SWAPPED

_THIRDS = [(INTO_TURNED[turns], np.roll(np.arange(3), -turns)) for turns in range(3)]
#: By name, the images (U u, p[order]) of a state (u, p) at which the potential is the same.
SYMMETRIES: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {
    "none": _THIRDS[:1],
    "mirror": [_THIRDS[0], (MIRROR, SWAPPED)],
    "full": [*_THIRDS, *((MIRROR @ turn, order[SWAPPED]) for turn, order in _THIRDS)],
}


@final
class RidgeNetwork(SectionLaw):
    """Network of one hidden layer in the curvature, its offsets a network of the pressures.

        Π(u, p) = −V₀ Σ p_k + E mean over images [F(x, q) − F(0, 0) − ∂F/∂x(0, 0)·x]
        F(x, q) = ½ |Lᵀ x|² + Σ_j c_j φ(d_j·x + e_j·h(q) + b_j) + v·h(q)
        h(q) = (q, tanh(W q + w)),    x = u/u_s,    q = p/p_s,    φ'(z) = (1 + z²)⁻²

    The mean is over the images of the state under the section's symmetry. At one pressure this is a sum of
    ridges of the curvature alone (see `RidgeLaw`), which a rod is integrated with. Potential and moment
    vanish at rest. The free curvature is the root of the moment near a guess that is linear in h,
    G (h(q) − h(0)).

    Attributes
    ----------
    feature_weights, feature_biases : W and w; the images may have a w each, (images, features).
    directions, mixing, offsets, weights : d, e, b and c.
    factor : lower triangle of L by rows, entries 11, 21, 22, 31, 32, 33. Far from all ridges the section has
        the stiffness L Lᵀ, and is stable.
    slopes : v.
    guess : G/u_s.
    pressure_scale : p_s [Pa].
    curvature_scale : u_s [1/m].
    energy_scale : E [J/m].
    rest_volume : V₀, chamber volume per length at rest [m²], up to what F adds.
    symmetry : of the section: ``none``; ``mirror``, y → −y, as at ψ = 0; ``full``, with 120° turns too, as of
        rings.
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
    pressure_scale: float = eqx.field(static=True)
    curvature_scale: float = eqx.field(static=True)
    energy_scale: float = eqx.field(static=True)
    rest_volume: float = eqx.field(static=True)
    symmetry: str = eqx.field(static=True, default="none")

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
        }
        for name, shape in expected.items():
            if getattr(self, name).shape != shape:
                raise ValueError(
                    f"{name}: got shape {getattr(self, name).shape}, expected {shape} with {features} "
                    f"features and {ridges} ridges"
                )
        if self.symmetry not in SYMMETRIES:
            raise ValueError(f"symmetry: got {self.symmetry!r}, expected one of {', '.join(SYMMETRIES)}")
        if self.feature_biases.ndim == 2 and len(self.feature_biases) != len(self.images):
            raise ValueError(
                f"feature_biases: got {len(self.feature_biases)} rows, expected one, or {len(self.images)}: "
                "one for each image"
            )
        for name in ("pressure_scale", "curvature_scale", "energy_scale", "rest_volume"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name}: got {value}, expected a positive number")

    @property
    def images(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of a state (u, p) under the symmetry, itself included: (U u, p[order]) for each U and order."""
        return SYMMETRIES[self.symmetry]

    def at(self, pressure: Float[Array, "3"]) -> RidgeLaw:
        """Contract the law to a function of the curvature."""
        return self.contracted(pressure).settled()

    def contracted(self, pressure: Float[Array, "3"]) -> RidgeLaw:
        """The law at one pressure, its free curvature the guess still."""
        share = 1.0 / len(self.images)
        still, rest = as_data(_at_rest, self)
        mixing, slopes, guess = (still.pop(name) for name in ("mixing", "slopes", "guess"))
        into, biases, bare = (still.pop(name) for name in ("feature_weights", "feature_biases", "bare"))
        offsets, value, free = [], still.pop("constant"), jnp.zeros(3, self.offsets.dtype)
        for image, (turn, order) in enumerate(self.images):
            inputs = _features(pressure[order] / self.pressure_scale, into, biases[image])
            change = inputs - rest[image]
            offsets.append(weighted_sum(inputs, mixing) + bare)
            value = value + share * weighted_sum(change, slopes)[0]
            free = free + self.curvature_scale * share * weighted_sum(change, guess) @ turn
        value = value - self.rest_volume / self.energy_scale * jnp.sum(pressure)
        return RidgeLaw(
            **still,
            offsets=jnp.concatenate(offsets),
            constant=value,
            free_curvature=free,
            energy_scale=self.energy_scale,
            curvature_scale=self.curvature_scale,
        )

    def potential(self, curvature: Float[Array, "3"], pressure: Float[Array, "3"]) -> Float[Array, ""]:
        """See `SectionLaw.potential`; does not seek the free curvature."""
        return self.contracted(pressure).energy(curvature)

    def moment(self, curvature: Float[Array, "3"], pressure: Float[Array, "3"]) -> Float[Array, "3"]:
        """See `SectionLaw.moment`; does not seek the free curvature."""
        return self.contracted(pressure).moment(curvature)

    def stiffness(self, curvature: Float[Array, "3"], pressure: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """See `SectionLaw.stiffness`; does not seek the free curvature."""
        return self.contracted(pressure).stiffness(curvature)

    def features(self, inputs: Float[Array, "3"], image: int = 0) -> Float[Array, " inputs"]:
        """h(q) of scaled pressures, those of an image."""
        biases = self.feature_biases if self.feature_biases.ndim == 1 else self.feature_biases[image]
        return _features(inputs, self.feature_weights.T, biases)


def _features(
    inputs: Float[Array, "3"], weights: Float[Array, "3 features"], biases: Float[Array, " features"]
) -> Float[Array, " inputs"]:
    """h(q) of scaled pressures."""
    return jnp.concatenate([inputs, jnp.tanh(weighted_sum(inputs, weights) + biases)])


def _at_rest(law: RidgeNetwork) -> tuple[dict[str, Any], Any]:
    """What does not move with the pressures: leaves of the contracted law, factors of h, and its h(0).

    Image by image: products of a matrix and a vector can be in a kernel, those of two matrices cannot.
    """
    xp: Any = np if isinstance(law.offsets, np.ndarray) else jnp
    turns = np.array([turn for turn, _ in law.images], law.offsets.dtype)
    share = 1.0 / len(turns)
    biases = xp.broadcast_to(law.feature_biases, (len(turns), law.feature_biases.shape[-1]))
    hidden = xp.tanh(biases)
    rest = xp.concatenate([xp.zeros((len(turns), 3), law.offsets.dtype), hidden], axis=1)
    a, b, c, d, e, f = law.factor
    lower = xp.stack([xp.stack(row) for row in ((a, 0.0 * a, 0.0 * a), (b, c, 0.0 * a), (d, e, f))])
    constant, slope, quadratic, directions = 0.0, 0.0, 0.0, []
    for turn, inputs in zip(turns, rest, strict=True):
        offsets = law.mixing @ inputs + law.offsets
        constant = constant - share * (law.weights @ ridge(offsets))
        slope = slope - share * (((law.weights * ridge_slope(offsets)) @ law.directions) @ turn)
        turned = turn.T @ lower
        quadratic = quadratic + share * (turned @ turned.T)
        directions.append(turned_rows(law.directions, turn))
    directions = xp.concatenate(directions)
    pairs, triples = powers(directions)
    leaves = {
        "constant": constant,
        "slope": slope,
        "quadratic": quadratic,
        "directions": directions,
        "pairs": pairs,
        "triples": triples,
        "weights": xp.tile(share * law.weights, len(turns)),
        "feature_weights": law.feature_weights.T,
        "feature_biases": biases,
        "bare": law.offsets,
        "mixing": law.mixing.T,
        "slopes": law.slopes[:, None],
        "guess": law.guess.T,
    }
    return leaves, rest
