"""Stable domain of a fitted law."""

import math
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from calibration.fit.any_law import AnyLaw, law_at
from calibration.fit.distil_mean import states_of
from calibration.fit.samples import Samples
from calibration.fit.upright import UPRIGHT
from rodmodel import Domain

PRESSURES = 20_000
# A free state counts as unstable if its least stiffness is below this fraction of the median: a law is not
# accurate so close to a loss of stability.
SOFTEST = 0.03
# Most supports that a law is given at a time.
SUPPORTS = 150
# Where the way to them begins, over their pressures, its number of pressures, and corrections at each.
_FROM, _SHARES, _CORRECTIONS = 0.6, 17, 3
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


def supports(law: AnyLaw, domain: Domain, seed: int = 0) -> Samples | None:
    """Return states that tell a law to stand where its free states are unstable; None if none is.

    The free state is followed from below, through the loss of stability, so that it is the upright one. All
    of it is the law's own but the least stiffness, which is `UPRIGHT` of the median: see
    `calibration.fit.upright`.
    """
    bad = unstable_pressures(law, domain, seed)
    if not len(bad):
        return None
    pressure = np.random.default_rng(seed).permutation(bad)[:SUPPORTS]
    psi = 2.0 * np.pi * np.random.default_rng(seed + 1).random(len(pressure))
    curvature = np.asarray(_followed(law, jnp.asarray(pressure), jnp.asarray(psi)))
    found = np.isfinite(curvature).all(axis=1)
    states = states_of([law], pressure[found], curvature[found], psi[found], "support")
    value, frame = np.linalg.eigh(states.hessian[:, :3, :3])
    lift = np.maximum(UPRIGHT * np.median(value, axis=1) - value[:, 0], 0.0)
    hessian = states.hessian.copy()
    hessian[:, :3, :3] += lift[:, None, None] * np.einsum("ni,nj->nij", frame[:, :, 0], frame[:, :, 0])
    return replace(states, hessian=hessian)


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
def _followed(law: AnyLaw, pressure: Float[Array, "n 3"], psi: Float[Array, " n"]) -> Float[Array, "n 3"]:
    """Return free curvatures that are followed along rays of pressure by Newton's method."""

    def one(p: Array, angle: Array) -> Array:
        section = law_at(law, angle)

        def step(state: tuple[Array, Array], share: Array) -> tuple[tuple[Array, Array], None]:
            last, change = state
            at, u = section.contracted(share * p), last + change
            for _ in range(_CORRECTIONS):
                u = u - jnp.linalg.solve(at.stiffness(u), at.moment(u))
            return (u, u - last), None

        shares = jnp.linspace(_FROM, 1.0, _SHARES)
        first = section.at(shares[0] * p).free_curvature
        return jax.lax.scan(step, (first, jnp.zeros(3)), shares[1:])[0][0]

    return jax.vmap(one)(pressure, psi)


@eqx.filter_jit
def _free_stiffness(
    law: AnyLaw, pressure: Float[Array, "n 3"], psi: Float[Array, " n"]
) -> Float[Array, "n 3 3"]:
    def one(p: Array, angle: Array) -> Array:
        at = law_at(law, angle).at(p)
        return at.stiffness(at.free_curvature)

    return jax.vmap(one)(pressure, psi)
