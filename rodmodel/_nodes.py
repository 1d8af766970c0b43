"""Chebyshev points of the body, and what interpolates and integrates a function given at them.

A function that is given by its values f_j at the nodes is taken for the polynomial through them. A rod that
turns by Θ over its body is met to about (Θ/4)ⁿ/n!, n the degree: far below rounding for a whole turn.

References
----------
Trefethen (2013), Approximation Theory and Approximation Practice, chs 2, 3 and 19; weights of Clenshaw and
Curtis (1960).
"""

import numpy as np
from numpy.polynomial import chebyshev

DEGREE = 24

_X = -np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)

NODES = 0.5 * (1.0 + _X)
"""Fractions of the body's length, increasing, both ends included."""

TO_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(_X, DEGREE))
"""Matrix from values at the nodes to coefficients of Chebyshev polynomials of 2 s/L − 1."""

INTEGRALS = 0.5 * chebyshev.chebvander(_X, DEGREE + 1) @ chebyshev.chebint(TO_COEFFICIENTS, lbnd=-1.0)
"""Matrix from values at the nodes to integrals over s/L from 0 to each node."""

WEIGHTS = INTEGRALS[-1]
"""Weights of the nodes in the integral over s/L from 0 to 1."""
