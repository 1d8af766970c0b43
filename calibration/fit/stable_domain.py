"""Stable domain of a fitted law."""

import math
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from calibration.fit.any_law import AnyLaw, law_at
from rodmodel import Domain

PRESSURES = 20_000
# A free state counts as unstable if its least stiffness is below this fraction of the median: a law is not
# accurate so close to a loss of stability.
SOFTEST = 0.03
# Pressures of each chamber alone at which a law is tested.
_SINGLES = 2000
# Largest change of the free curvature, over itself, by the little that the others may have: more is a section
# that leans over, which a law may call stable, and next to its end has several of.
LEANS = 0.1
# A narrowed domain is rounded down to a multiple of a round number of pascals: a fortieth to a four-hundredth
# of its largest pressure.
_LEAST_STEPS = 40.0


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
    return pressure[_unstable(law, pressure, 2.0 * np.pi * rng.random(PRESSURES))]


def _unstable(
    law: AnyLaw, pressure: Float[np.ndarray, "n 3"], psi: Float[np.ndarray, " n"]
) -> Bool[np.ndarray, " n"]:
    """Return where the law's free state is not stable, or is not found."""
    stiffness = np.asarray(_free_stiffness(law, jnp.asarray(pressure), jnp.asarray(psi)))
    softest = np.linalg.eigvalsh(np.where(np.isfinite(stiffness), stiffness, 0.0))[:, 0]
    bad: np.ndarray = softest < SOFTEST * np.median(softest)
    return bad


def narrowed(law: AnyLaw, domain: Domain) -> Domain:
    """Lower the largest pressures of a domain in proportion until the law is stable inside it.

    Those of single chambers are lowered to where the law stands, chamber by chamber.
    """
    bad, step = unstable_pressures(law, domain), _step(domain)
    while len(bad):
        share = float((bad / np.asarray(domain.pressure_max)).max(axis=1).min())
        first, second, third = (
            step * (math.ceil(share * largest / step) - 1) for largest in domain.pressure_max
        )
        domain = replace(domain, pressure_max=(first, second, third))
        bad = unstable_pressures(law, domain)
    return replace(domain, single_max=_single_max(law, domain, step))


def _step(domain: Domain) -> float:
    """Return the step of a domain's pressures [Pa], such as 500 Pa for 20 to 200 kPa."""
    largest = max(domain.pressure_max) / _LEAST_STEPS
    return float(5.0 * 10.0 ** math.floor(math.log10(largest / 5.0)))


def _single_max(law: AnyLaw, domain: Domain, step: float) -> tuple[float, float, float]:
    """Return the largest pressure of each chamber alone up to which the law stands; 0 if it gains none."""
    rng = np.random.default_rng(0)
    found = []
    for chamber, most in enumerate(domain.single_max):
        if most <= 0.0:
            found.append(0.0)
            continue
        pressure = domain.single_beside * rng.random((_SINGLES, 3))
        pressure[:, chamber] = most * np.linspace(0.0, 1.0, _SINGLES)
        psi = 2.0 * np.pi * rng.random(_SINGLES)
        bad = pressure[_unstable(law, pressure, psi) | _leans(law, pressure, psi, chamber), chamber]
        end = most if not len(bad) else step * (math.ceil(float(bad.min()) / step) - 1)
        found.append(end if end > domain.pressure_max[chamber] else 0.0)
    return found[0], found[1], found[2]


def _leans(
    law: AnyLaw, pressure: Float[np.ndarray, "n 3"], psi: Float[np.ndarray, " n"], chamber: int
) -> Bool[np.ndarray, " n"]:
    """Return where the free curvature is not near that of the chamber alone."""
    alone = np.zeros_like(pressure)
    alone[:, chamber] = pressure[:, chamber]
    angle = jnp.asarray(psi)
    there, own = (np.asarray(_free_curvature(law, jnp.asarray(p), angle))[:, :2] for p in (pressure, alone))
    near = np.linalg.norm(there - own, axis=1) <= LEANS * np.linalg.norm(own, axis=1)
    # Where the chamber itself has little, the others' little is no small part.
    leans: Bool[np.ndarray, " n"] = ~near & (pressure[:, chamber] > 0.5 * pressure[:, chamber].max())
    return leans


@eqx.filter_jit
def _free_curvature(
    law: AnyLaw, pressure: Float[Array, "n 3"], psi: Float[Array, " n"]
) -> Float[Array, "n 3"]:
    return jax.vmap(lambda p, angle: law_at(law, angle).at(p).free_curvature)(pressure, psi)


@eqx.filter_jit
def _free_stiffness(
    law: AnyLaw, pressure: Float[Array, "n 3"], psi: Float[Array, " n"]
) -> Float[Array, "n 3 3"]:
    def one(p: Array, angle: Array) -> Array:
        at = law_at(law, angle).at(p)
        return at.stiffness(at.free_curvature)

    return jax.vmap(one)(pressure, psi)
