"""Contact energy between the cavity's wall and the rod, per reference area, as a function of the gap.

The wall may separate from the rod; a barrier keeps it from penetrating:

    b(d) = −k (d − d̂)² ln(d/d̂)   for d₀ < d < d̂,   d = gap + 0.9 d̂.

Below d₀ = 0.1 d̂ the barrier continues as a parabola with two continuous derivatives, so that no Newton step
is blocked by a node that penetrates for the moment. The contact pressure is 0.24 MPa after 0.8 d̂ = 0.016 mm
inwards, and grows by as much with every further 0.002 mm. At rest the wall just touches the rod, and the
slope of b, 0.6 kPa, centres it. Lengths mm, pressures MPa.

References
----------
Li et al. (2020), Incremental Potential Contact, eq. 6, for the barrier's form.
"""

import numpy as np
from jaxtyping import Float

#: Activation distance d̂ [mm].
ACTIVATION = 0.02
#: d at rest, relative to d̂.
REST_SHARE = 0.9
#: Stiffness k [MPa/mm].
STIFFNESS = 1.0
# d₀, below which the barrier is a parabola, relative to d̂.
_PARABOLA_BELOW = 0.1
#: Penetration [mm] under 0.5 MPa, about the contact pressure at 50 kPa in the chambers.
PRESSED = REST_SHARE * ACTIVATION
#: Largest penetration while Newton's method iterates, relative to the rod's radius.
INSIDE_SHARE = 0.5


def barrier(
    d: Float[np.ndarray, "*contacts"],
) -> tuple[Float[np.ndarray, "*contacts"], Float[np.ndarray, "*contacts"], Float[np.ndarray, "*contacts"]]:
    """Return b(d), b'(d), b''(d) per area [N/mm, MPa, MPa/mm]; zero where d ≥ d̂."""
    t = np.minimum(d / ACTIVATION, 1.0)
    # Argument of the logarithmic law, and the way beyond it on the parabola.
    law = np.maximum(t, _PARABOLA_BELOW)
    beyond = ACTIVATION * (t - law)
    log = np.log(law)
    energy = -STIFFNESS * ACTIVATION**2 * (law - 1.0) ** 2 * log
    slope = -STIFFNESS * ACTIVATION * (2.0 * (law - 1.0) * log + (law - 1.0) ** 2 / law)
    curve = -STIFFNESS * (2.0 * log + 4.0 * (law - 1.0) / law - ((law - 1.0) / law) ** 2)
    return energy + beyond * (slope + 0.5 * beyond * curve), slope + beyond * curve, curve
