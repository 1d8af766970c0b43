"""Rods of several windings as one, whose arrays have a leading axis: a batch over layouts."""

from collections.abc import Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp

from rodmodel.actuator import Domain
from rodmodel.rod._rod import Rod
from rodmodel.section import in_common_form


def stack(rods: Sequence[Rod]) -> Rod:
    """Put rods of different calibrations, windings and dimensions on a leading axis, for `jax.vmap`.

    ``jax.vmap(lambda rod, p: rod.solve(p, throw=False))(stack(rods), pressures)`` solves each with its own
    pressures. `jax.tree.map(lambda x: x[which], stack(rods))` picks rods, one for each entry of `which`, in
    any order and as often as wanted.

    Parameters
    ----------
    rods : at least one, each of a calibration's law.

    Returns
    -------
    rods : whose `solve` and `jacobian` are for `jax.vmap`; `inverse` and predictors are of one rod. Each
        solves as it did alone, to rounding; what every one costs is that of the one with the most ridges.

    Raises
    ------
    ValueError
        Where there is no rod, or one's law is not of a calibration.
    """
    if not rods:
        raise ValueError("rods: got none, expected at least one")
    alike = [
        Rod(law, rod.actuator, _with_torque(rod.domain), rod.angle_error)
        for rod, law in zip(rods, in_common_form([rod.section for rod in rods]), strict=True)
    ]
    stacked: Rod = jax.tree.map(
        lambda *leaves: jnp.stack([jnp.asarray(leaf, float) for leaf in leaves]), *alike
    )
    return stacked


def _with_torque(domain: Domain) -> Domain:
    """The same domain with its torque in a number."""
    return replace(domain, torque_max=domain.moment_axes[2])
