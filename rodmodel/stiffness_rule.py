"""The paper's rule of thumb for how stiff a double helix makes each chamber, from its orientation alone.

What is known: the two threads cross at azimuths ψ and ψ + 180°. The further a chamber's centre is from the
nearest crossing, ψ'_n, the stiffer the chamber bends; the rule's measure is R_n = ψ'_n/(180° − ψ'_n), from 0
at a crossing to 1 midway between two. The paper finds ψ = 0° and 12° best by its rule, and 30° inferior.

What is not known to us is the quantity that the paper minimises, so none is given here. From the R_n it
follows that their sum, their largest and their spread (largest less smallest) are all least at ψ = 0°, rise
on the way to 30° and are largest there. The rest follows by symmetry: ψ + 60° only renumbers the chambers,
and −ψ is a mirror image. This agrees with the paper's 0° and 30°, but 12° is no optimum of any of the three.
Near 11.75° the R_n are evenly spaced, so that no two chambers are alike; that this is why the paper names
12° is a guess.

The rule knows nothing of pressure or pitch. A calibrated rod does, and is what to decide by.

References
----------
"Modeling of a two-degree-of-freedom fiber-reinforced soft pneumatic actuator", Robotica (2023), Eqs 5–10.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

_CENTRES = 2.0 * np.pi / 3.0 * np.arange(3)


def crossing_distance(psi: Float[Array, ""] | float) -> Float[Array, "3"]:
    """Angular distance ψ'_n from the centre of each chamber to the nearest crossing of a double helix.

    Parameters
    ----------
    psi : winding orientation, from the centre of chamber 1 [rad].

    Returns
    -------
    distance : of chambers 1, 2, 3, between 0 and π/2 [rad].

    References
    ----------
    Robotica (2023), Eqs 5–10.
    """
    offset = _CENTRES - psi
    # Crossings repeat every half turn.
    return jnp.abs(offset - jnp.pi * jnp.round(offset / jnp.pi))


def stiffness_ratio(psi: Float[Array, ""] | float) -> Float[Array, "3"]:
    """Measure R_n = ψ'_n/(π − ψ'_n) of how stiff each chamber is, relative to the others.

    Parameters
    ----------
    psi : winding orientation, from the centre of chamber 1 [rad].

    Returns
    -------
    ratio : of chambers 1, 2, 3: the arc to the nearest crossing over the arc to the next, between 0 and 1.

    References
    ----------
    Robotica (2023), Eqs 5–10.
    """
    near = crossing_distance(psi)
    return near / (jnp.pi - near)
