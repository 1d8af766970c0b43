"""Energy of the interface between the cavity's wall and the rod, per reference area, by the gap between them.

The wall may leave the rod; a barrier keeps it from entering:

    b(d) = −k (d − d̂)² ln(d/d̂)   for d₀ < d < d̂,   d = gap + 0.9 d̂,

and below d₀ = 0.1 d̂ the parabola that goes on from there: the contact pressure is 0.24 MPa when the wall has
moved 0.8 d̂ = 0.016 mm inwards, and grows by as much with every further 0.002 mm. The energy has two
continuous derivatives, and none of Newton's steps is blocked by a node that would go too far for the moment.
At rest the wall just touches the rod: it is centred there by b's slope, 0.6 kPa. Lengths mm, pressures MPa.

References
----------
Li et al. (2020), Incremental Potential Contact, eq. 6, for the barrier's form.
"""

import numpy as np
from jaxtyping import Float

ACTIVATION = 0.02
REST_SHARE = 0.9
STIFFNESS = 1.0
_CLOSE = 0.1
#: How far inside the rod's surface a wall is under 0.5 MPa [mm], about as much as presses it at 50 kPa.
PRESSED = REST_SHARE * ACTIVATION
#: Share of the rod's radius by which a node may be inside it while Newton's method iterates.
INSIDE_SHARE = 0.5


def barrier(
    d: Float[np.ndarray, "*contacts"],
) -> tuple[Float[np.ndarray, "*contacts"], Float[np.ndarray, "*contacts"], Float[np.ndarray, "*contacts"]]:
    """b(d), b'(d), b''(d) per area [N/mm, MPa, MPa/mm]; zero where d ≥ d̂."""
    t = np.minimum(d / ACTIVATION, 1.0)
    # As far as the barrier's own law goes, and how much farther in.
    held = np.maximum(t, _CLOSE)
    beyond = ACTIVATION * (t - held)
    log = np.log(held)
    energy = -STIFFNESS * ACTIVATION**2 * (held - 1.0) ** 2 * log
    slope = -STIFFNESS * ACTIVATION * (2.0 * (held - 1.0) * log + (held - 1.0) ** 2 / held)
    curve = -STIFFNESS * (2.0 * log + 4.0 * (held - 1.0) / held - ((held - 1.0) / held) ** 2)
    return energy + beyond * (slope + 0.5 * beyond * curve), slope + beyond * curve, curve
