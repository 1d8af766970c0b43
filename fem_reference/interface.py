"""Energy of the interface between the cavity's wall and the rod, per reference area, by the gap between them.

The wall may leave the rod; a barrier keeps it from entering:

    b(d) = −k (d − d̂)² ln(d/d̂)   for 0 < d < d̂,   d = gap + 0.9 d̂,

so that the contact pressure grows without bound before the wall has moved 0.9 d̂ = 0.018 mm inwards, and the
energy has two continuous derivatives. At rest the wall just touches the rod: it is centred there by b's
slope, 0.6 kPa. Lengths mm, pressures MPa.

References
----------
Li et al. (2020), Incremental Potential Contact, eq. 6, for the barrier's form.
"""

import numpy as np
from jaxtyping import Float

ACTIVATION = 0.02
REST_SHARE = 0.9
STIFFNESS = 1.0


def barrier(
    d: Float[np.ndarray, " contacts"],
) -> tuple[Float[np.ndarray, " contacts"], Float[np.ndarray, " contacts"], Float[np.ndarray, " contacts"]]:
    """b(d), b'(d), b''(d) per area [N/mm, MPa, MPa/mm]; infinite where d ≤ 0, zero where d ≥ d̂."""
    active = d < ACTIVATION
    t = np.where(active, d / ACTIVATION, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        log = np.log(t)
        energy = -STIFFNESS * ACTIVATION**2 * (t - 1.0) ** 2 * log
        slope = -STIFFNESS * ACTIVATION * (2.0 * (t - 1.0) * log + (t - 1.0) ** 2 / t)
        curve = -STIFFNESS * (2.0 * log + 4.0 * (t - 1.0) / t - ((t - 1.0) / t) ** 2)
    inside = d <= 0.0
    return np.where(inside, np.inf, energy), np.where(inside, -np.inf, slope), np.where(inside, np.inf, curve)
