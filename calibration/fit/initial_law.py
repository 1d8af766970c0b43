"""Initial law of a fit: scales and random weights; and the final guess of the free curvature."""

import math
from dataclasses import dataclass, replace
from typing import TypeVar, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from calibration.fit.any_law import law_at
from calibration.sweep import edge
from rodmodel import Domain, OrientedNetwork, RidgeNetwork

# Number of pressures at which the guess is fitted.
_PRESSURES = 2000
# Extent of these pressures relative to the domain.
_BEYOND = 1.1
# Steps from rest to each of them.
_STEPS = 30


@dataclass(frozen=True)
class Scales:
    """Fixed scales of a law, with which its coefficients are of order one.

    They depend only on the actuator's dimensions and the domain, so that laws of different windings have
    equal scales and can be stacked.
    """

    pressure: float
    curvature: float
    energy: float
    rest_volume: float

    @classmethod
    def of(cls, domain: Domain, body_length: float, chamber_area: float) -> "Scales":
        """Return the scales for a domain, a body length [m], and a chamber area [m²]."""
        pressure = 0.4 * float(max(domain.pressure_max))
        return cls(pressure, math.pi / body_length, pressure * chamber_area, chamber_area)


def initial_law(scales: Scales, ridges: int, features: int, seed: int, symmetry: str) -> RidgeNetwork:
    """Return an untrained law.

    Parameters
    ----------
    scales : scales of the law.
    ridges, features : size of the law.
    seed : seed of the random weights.
    symmetry : symmetry of the section.
    """
    rng = np.random.default_rng(seed)
    inputs = 3 + features
    return RidgeNetwork(
        feature_weights=jnp.asarray(1.5 * rng.standard_normal((features, 3)) / math.sqrt(3.0)),
        feature_biases=jnp.asarray(0.5 * rng.standard_normal(features)),
        directions=jnp.asarray(rng.standard_normal((ridges, 3))),
        mixing=jnp.asarray(rng.standard_normal((ridges, inputs)) / math.sqrt(inputs)),
        offsets=jnp.asarray(rng.standard_normal(ridges)),
        weights=jnp.asarray(0.1 * rng.standard_normal(ridges)),
        factor=jnp.asarray(np.eye(3)[np.tril_indices(3)]),
        slopes=jnp.zeros(inputs),
        guess=jnp.zeros((3, inputs)),
        pressure_scale=scales.pressure,
        curvature_scale=scales.curvature,
        energy_scale=scales.energy,
        rest_volume=scales.rest_volume,
        symmetry=symmetry,
    )


def initial_oriented(scales: Scales, ridges: int, features: int, seed: int) -> OrientedNetwork:
    """Return an untrained law of all orientations; see `initial_law`."""
    rng = np.random.default_rng([seed, 1])
    network = initial_law(scales, ridges, features, seed, "full")
    return OrientedNetwork(network, jnp.asarray(0.5 * rng.standard_normal((features, 2))))


def random_pressures(
    domain: Domain, number: int, beyond: float, rng: np.random.Generator
) -> Float[np.ndarray, "n 3"]:
    """Draw pressures [Pa] in a domain ``beyond`` times as large; those outside are scaled to its edge."""
    least, most = np.asarray(domain.pressure_min), beyond * np.asarray(domain.pressure_max)
    pressure = least + rng.random((number, 3)) * (most - least)
    return np.minimum(pressure, beyond * edge(domain, pressure))


FittedLaw = TypeVar("FittedLaw", RidgeNetwork, OrientedNetwork)


def with_guess(law: FittedLaw, domain: Domain, seed: int = 0) -> FittedLaw:
    """Fit the law's guess of its free curvature, by least squares to roots at random pressures.

    The roots are followed from rest along straight rays of pressure, as in loading; at random orientations
    for a law of all orientations.
    """
    rng = np.random.default_rng(seed)
    pressure = random_pressures(domain, _PRESSURES, _BEYOND, rng)
    psi = 2.0 * np.pi * rng.random(_PRESSURES)
    roots = np.asarray(_roots(law, jnp.asarray(pressure), jnp.asarray(psi)))
    found = np.isfinite(roots).all(axis=1)

    network = law.network if isinstance(law, OrientedNetwork) else law
    turns, orders = map(np.stack, zip(*network.images, strict=True))
    scaled = jnp.asarray(pressure[found][:, orders] / network.pressure_scale)
    change = np.asarray(_changes(law, scaled, jnp.asarray(psi[found])))
    rows = np.einsum("mji,nmk->nijk", turns, change) / len(orders)
    target = (roots[found] / network.curvature_scale).ravel()
    solution = np.linalg.lstsq(rows.reshape(len(target), -1), target, rcond=1e-8)[0]
    guess = jnp.asarray(solution.reshape(3, -1))
    if isinstance(law, OrientedNetwork):
        return replace(law, network=replace(law.network, guess=guess))
    return replace(law, guess=guess)


@eqx.filter_jit
def _roots(law: FittedLaw, pressure: Float[Array, "n 3"], psi: Float[Array, " n"]) -> Float[Array, "n 3"]:
    """Return the free curvatures at the ends of straight rays of pressure."""

    def along(p: Array, angle: Array) -> Array:
        section = cast(RidgeNetwork, law_at(law, angle))

        def step(start: Array, share: Array) -> tuple[Array, None]:
            at = replace(section.contracted(share * p), free_curvature=start)
            return at.settled().free_curvature, None

        return jax.lax.scan(step, jnp.zeros(3), jnp.arange(1, _STEPS + 1) / _STEPS)[0]

    return jax.vmap(along)(pressure, psi)


@eqx.filter_jit
def _changes(
    law: FittedLaw, scaled: Float[Array, "n images 3"], psi: Float[Array, " n"]
) -> Float[Array, "n images inputs"]:
    """Return h(q) − h(0) for each image."""

    def one(q: Array, angle: Array) -> Array:
        section = cast(RidgeNetwork, law_at(law, angle))
        return section.features(q) - section.features(0.0 * q)

    return jax.vmap(one)(scaled, psi)
