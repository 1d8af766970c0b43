"""A fitted law with as many digits as a file shows."""

import dataclasses
import math
from typing import Any

from fem_reference.materials import Material, Ogden

# A fit tells no more; the stress changes by 1e-5 of a term.
_DIGITS = 6
_RANGE_DIGITS = 4


def rounded(material: Material) -> Material:
    """Return a law with its constants and range rounded, so that a file holds the same law.

    The range is rounded inwards. Ogden terms that are left with nothing are dropped.
    """
    changed: dict[str, Any] = {"bulk_modulus": None}
    if isinstance(material, Ogden):
        kept = [
            (_significant(mu), _significant(alpha))
            for mu, alpha in zip(material.shear_moduli, material.exponents, strict=True)
            if mu != 0.0
        ]
        changed["shear_moduli"], changed["exponents"] = (tuple(values) for values in zip(*kept, strict=True))
    else:
        changed["constants"] = tuple(_significant(c) for c in material.constants)  # type: ignore[attr-defined]
    if material.stretch_range is not None:
        size = 10.0**_RANGE_DIGITS
        least, most = material.stretch_range
        # Rounding of a stretch that was a short number.
        slack = 1e-6
        changed["stretch_range"] = (
            math.ceil(least * size - slack) / size,
            math.floor(most * size + slack) / size,
        )
    try:
        return dataclasses.replace(material, **changed)  # type: ignore[type-var]
    except ValueError:
        # Constants at the edge of stability.
        return material


def _significant(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
