"""The paper's rule of thumb for how stiff a double helix makes each chamber, from its orientation alone.

The two threads cross at azimuths ψ and ψ + 180°. The further a chamber's centre is from the nearest
crossing, ψ'_n, the stiffer the chamber bends; the rule's measure is R_n = ψ'_n/(180° − ψ'_n), from 0 at a
crossing to 1 midway between two. The paper finds ψ = 0° and 12° best by its rule, and 30° inferior.

The paper does not state the quantity that it minimises, so none is given here. The sum of the R_n, the
largest of them and their spread (largest less smallest) are all least at ψ = 0° and rise towards 30°, where
they are largest. The rest follows by symmetry: ψ + 60° only renumbers the chambers, and −ψ is a mirror
image. This agrees with the paper's 0° and 30°, but 12° is no optimum of any of the three. Near 11.75° the
R_n are evenly spaced, so that no two chambers are alike; this may be why the paper names 12°.

The rule ignores pressure and pitch. Decide by a calibrated rod, which includes both.

References
----------
"Modeling of a two-degree-of-freedom fiber-reinforced soft pneumatic actuator", Robotica (2023), Eqs 5–10.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

_CENTRES = 2.0 * np.pi / 3.0 * np.arange(3)


def crossing_distance(psi: Float[Array, ""] | float) -> Float[Array, "3"]:
    """Return the angular distance ψ'_n from each chamber's centre to the nearest crossing of a double helix.

    Parameters
    ----------
    psi : winding orientation, from the centre of chamber 1 [rad].

    Returns
    -------
    distance : distances of chambers 1, 2, 3, between 0 and π/2 [rad].

    References
    ----------
    Robotica (2023), Eqs 5–10.
    """
    offset = _CENTRES - psi
    # Crossings repeat every half turn.
    return jnp.abs(offset - jnp.pi * jnp.round(offset / jnp.pi))


def stiffness_ratio(psi: Float[Array, ""] | float) -> Float[Array, "3"]:
    """Return the relative stiffness R_n = ψ'_n/(π − ψ'_n) of each chamber.

    Parameters
    ----------
    psi : winding orientation, from the centre of chamber 1 [rad].

    Returns
    -------
    ratio : arc to the nearest crossing over the arc to the next, between 0 and 1, for chambers 1, 2, 3.

    References
    ----------
    Robotica (2023), Eqs 5–10.
    """
    near = crossing_distance(psi)
    return near / (jnp.pi - near)
