"""Where a path leads from the states behind it, and how far that may be trusted.

States lie at 0 and at −b for each b of ``back``; the polynomial through them is taken at +step.
"""

import math

import numpy as np


def weights(step: float, back: list[float]) -> list[float]:
    """Of the states at 0 and −b in the polynomial's value; they add up to one."""
    nodes = np.array([0.0, *(-b for b in back)])
    return [
        float(np.prod([(step - other) / (node - other) for other in np.delete(nodes, i)]))
        for i, node in enumerate(nodes)
    ]


def allowed_step(step: float, back: list[float], ahead: list[float], longest: float, stride: float) -> float:
    """The next step that leaves Newton's method its stride, where the last left it ``longest``.

    A polynomial through the states at 0 and −b misses by h ∏(h + b), times a derivative that is taken for the
    same in both steps.

    Parameters
    ----------
    step, back : of the last step, and the states that it was extrapolated from.
    ahead : the states that the next one will be extrapolated from.
    longest, stride : what Newton's method had to add, and what it is to add [mm].
    """
    if not back or math.isinf(stride) or not longest > 0.0:
        return math.inf
    scale = longest / np.polyval(np.poly([0.0, *(-b for b in back)]), step)
    missed = np.poly([0.0, *(-b for b in ahead)])
    missed[-1] -= stride / scale
    roots = np.roots(missed)
    return float(roots[np.abs(roots.imag) <= 1e-9 * np.abs(roots)].real.max())
