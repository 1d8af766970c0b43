"""The paper's actuator: numbers of its design file, ``paper.toml``, which are the defaults of all parts.

No code knows them otherwise. Bodies of other sizes are computed in units of this one; see
`fem_reference.geometry.Units`.
"""

import tomllib
from decimal import Decimal
from functools import cache
from importlib.resources import files
from typing import Any


def paper_numbers(table: str, key: str, power: int = 0) -> tuple[float, ...]:
    """Return the numbers of a key, times a power of ten.

    They are exact: 11.2 mm are the nearest number to 0.0112 m, which 11.2 over 1000 need not be.
    """
    value = _tables()[table][key]
    each = value if isinstance(value, list) else [value]
    return tuple(float(Decimal(one).scaleb(power)) for one in each)


def paper_number(table: str, key: str, power: int = 0) -> float:
    """Return the one number of a key, times a power of ten."""
    (value,) = paper_numbers(table, key, power)
    return value


@cache
def _tables() -> dict[str, Any]:
    text = files("fem_reference.geometry").joinpath("paper.toml").read_text(encoding="utf-8")
    return tomllib.loads(text, parse_float=Decimal)
