"""A law is shipped only where its free states are stable."""

import jax.numpy as jnp
import numpy as np
import pytest

from calibration.fit import narrowed
from calibration.fit.stable_domain import unstable_pressures
from rodmodel import Domain, LinearLaw, SectionLaw

DOMAIN = Domain((60e3, 50e3, 50e3), 90e3, 1e-3)
STIFFNESS = 2.5e-4


class Softening(SectionLaw):
    """Linear at each pressure; the first direction loses its stiffness as chamber 1 comes to `limit` [Pa]."""

    limit: float

    def at(self, pressure):
        """Stiffness at one pressure."""
        soft = STIFFNESS * (1.0 - pressure[0] / self.limit)
        stiffness = jnp.diag(jnp.stack([soft, jnp.asarray(STIFFNESS), jnp.asarray(STIFFNESS)]))
        return LinearLaw(stiffness, jnp.zeros((3, 3))).at(pressure)


class Rootless(Softening):
    """As it, and without a free state beyond the limit."""

    def at(self, pressure):
        """Stiffness at one pressure, not a number where there is no free state."""
        good = pressure[0] < self.limit
        return LinearLaw(STIFFNESS * jnp.eye(3) * jnp.where(good, 1.0, jnp.nan), jnp.zeros((3, 3))).at(
            pressure
        )


def test_a_law_that_is_stable_keeps_its_domain():
    law = Softening(100e3)
    assert len(unstable_pressures(law, DOMAIN)) == 0
    assert narrowed(law, DOMAIN) == DOMAIN


@pytest.mark.parametrize("law", [Softening(45e3), Rootless(45e3)])
def test_a_domain_ends_before_the_law_is_unstable(law):
    """In proportion: 45 of 60 kPa is three quarters. Softest is what has 3 % of the median stiffness."""
    bad = unstable_pressures(law, DOMAIN)
    assert len(bad) > 1000
    assert bad[:, 0].min() > 0.9 * 45e3
    assert np.all(bad.sum(axis=1) <= 90e3)
    found = narrowed(law, DOMAIN)
    assert 43e3 <= found.pressure_max[0] <= 45e3
    assert found.pressure_max[1] == found.pressure_max[2] < 0.76 * 50e3
    assert found.pressure_sum_max == DOMAIN.pressure_sum_max
    assert len(unstable_pressures(law, found)) == 0


@pytest.mark.parametrize(("modulus", "step"), [(0.1, 50.0), (0.4, 500.0), (10.0, 5e3)])
def test_a_domain_ends_at_a_round_pressure_of_its_size(modulus, step):
    """One body softer or stiffer than another: the same share of its pressures, to the rounding."""
    domain = Domain((modulus * 60e3,) * 3, modulus * 90e3, 1e-3)
    found = narrowed(Softening(modulus * 45e3), domain).pressure_max[0]
    assert found / step == pytest.approx(round(found / step), abs=1e-9)
    assert modulus * 45e3 - max(0.05 * modulus * 45e3, 2.0 * step) <= found <= modulus * 45e3


class Leaning(Softening):
    """Stable everywhere; beyond `limit` [Pa] of chamber 1 a little in chamber 2 bends it aside."""

    def at(self, pressure):
        """Chamber 1 bends about y, chamber 2 about x by the more the more the first one has."""
        aside = 20.0 / (1.0 + jnp.exp((self.limit - pressure[0]) / 200.0))
        moments = 1e-7 * jnp.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
        return LinearLaw(STIFFNESS * jnp.eye(3), moments.at[0, 1].set(1e-7 * aside)).at(pressure)


def test_a_chamber_alone_ends_before_the_little_in_the_others_bends_it_aside():
    domain = Domain((40e3, 40e3, 40e3), 90e3, 1e-3, single_max=(70e3, 0.0, 0.0), single_beside=2e3)
    found = narrowed(Leaning(60e3), domain)
    assert found.pressure_max == domain.pressure_max
    assert 57e3 < found.single_max[0] < 60.5e3
    assert narrowed(Leaning(90e3), domain).single_max == domain.single_max
