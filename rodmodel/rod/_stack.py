"""Stacking of rods of several windings into one batch."""

from collections.abc import Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp

from rodmodel.actuator import Domain
from rodmodel.rod._rod import Rod
from rodmodel.section import in_common_form


def stack(rods: Sequence[Rod]) -> Rod:
    """Stack rods of different calibrations, windings and dimensions along a leading axis, for `jax.vmap`.

    ``jax.vmap(lambda rod, p: rod.solve(p, throw=False))(stack(rods), pressures)`` solves each with its own
    pressures. `jax.tree.map(lambda x: x[which], stack(rods))` picks rods, one for each entry of `which`, in
    any order and as often as wanted.

    Parameters
    ----------
    rods : at least one rod, each with a calibration's law.

    Returns
    -------
    rods : stacked rods, for `solve` and `jacobian` under `jax.vmap`; `inverse` and predictors need a single
        rod. Each gives the solution that it gives alone, to rounding, at the cost of the rod with the most
        ridges.

    Raises
    ------
    ValueError
        For no rods, or a law that is not a calibration's.
    """
    if not rods:
        raise ValueError("rods: got none, expected at least one")
    alike = [
        Rod(law, rod.actuator, _with_torque(rod.domain), rod.error_bound.padded)
        for rod, law in zip(rods, in_common_form([rod.section for rod in rods]), strict=True)
    ]
    stacked: Rod = jax.tree.map(
        lambda *leaves: jnp.stack([jnp.asarray(leaf, float) for leaf in leaves]), *alike
    )
    return stacked


def _with_torque(domain: Domain) -> Domain:
    """Return the domain with its largest torque as a number."""
    return replace(domain, torque_max=domain.moment_axes[2])
