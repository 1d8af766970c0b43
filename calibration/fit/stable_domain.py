"""Stable domain of a fitted law."""

import math
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from calibration.fit.any_law import AnyLaw, law_at
from rodmodel import Domain

PRESSURES = 20_000
# A free state counts as unstable if its least stiffness is below this fraction of the median: a law is not
# accurate so close to a loss of stability.
SOFTEST = 0.03
_STEP = 500.0  # a narrowed domain is rounded down to a multiple of this [Pa]


def unstable_pressures(law: AnyLaw, domain: Domain, seed: int = 0) -> Float[np.ndarray, "n 3"]:
    """Return random pressures inside a domain at which the law has no stable free state [Pa].

    A law that is wrong between the states of its fit usually has no free state there, or an unstable one. A
    law of all orientations is tested at random ones.
    """
    rng = np.random.default_rng(seed)
    pressure = np.zeros((0, 3))
    while len(pressure) < PRESSURES:
        least = np.asarray(domain.pressure_min)
        more = least + rng.random((PRESSURES, 3)) * (np.asarray(domain.pressure_max) - least)
        pressure = np.concatenate([pressure, more[np.asarray(domain.covers_pressure(more.T))]])
    pressure = pressure[:PRESSURES]
    psi = 2.0 * np.pi * rng.random(PRESSURES)
    stiffness = np.asarray(_free_stiffness(law, jnp.asarray(pressure), jnp.asarray(psi)))
    softest = np.linalg.eigvalsh(np.where(np.isfinite(stiffness), stiffness, 0.0))[:, 0]
    return pressure[softest < SOFTEST * np.median(softest)]


def narrowed(law: AnyLaw, domain: Domain) -> Domain:
    """Lower the largest pressures of a domain in proportion until the law is stable inside it."""
    bad = unstable_pressures(law, domain)
    while len(bad):
        share = float((bad / np.asarray(domain.pressure_max)).max(axis=1).min())
        first, second, third = (
            _STEP * (math.ceil(share * largest / _STEP) - 1) for largest in domain.pressure_max
        )
        domain = replace(domain, pressure_max=(first, second, third))
        bad = unstable_pressures(law, domain)
    return domain


@eqx.filter_jit
def _free_stiffness(
    law: AnyLaw, pressure: Float[Array, "n 3"], psi: Float[Array, " n"]
) -> Float[Array, "n 3 3"]:
    def one(p: Array, angle: Array) -> Array:
        at = law_at(law, angle).at(p)
        return at.stiffness(at.free_curvature)

    return jax.vmap(one)(pressure, psi)
