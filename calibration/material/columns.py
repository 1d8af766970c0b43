"""What a column of a material test holds, by the names and units that test machines give it."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

#: Quantities that a test is made from, with the words for them, in lower case.
_WORDS = {
    "stretch": {"stretch", "lambda", "λ", "streckung", "streckverhältnis", "verstreckung"},
    "strain": {"strain", "dehnung", "ε", "eps", "epsilon", "stauchung"},
    "stress": {"stress", "spannung", "σ", "sigma"},
    "force": {"force", "load", "kraft", "standardkraft", "prüfkraft", "zugkraft"},
    "displacement": {
        "displacement",
        "extension",
        "elongation",
        "crosshead",
        "position",
        "weg",
        "standardweg",
        "traversenweg",
        "traverse",
        "verschiebung",
        "verlängerung",
    },
}
# Strain and stress of the deformed body.
_TRUE = {"true", "cauchy", "wahre", "wahrer", "log", "logarithmic", "logarithmische", "hencky"}
# Columns of something else, although a word above is in their name.
_OTHERS = {
    *("rate", "speed", "time", "energy", "modulus", "strength"),
    *("lateral", "transverse", "quer", "querdehnung"),
    *("max", "maximum", "break", "rupture", "yield", "bruch"),
}
_STRESS = {
    "pa": 1.0,
    "kpa": 1e3,
    "mpa": 1e6,
    "psi": 6894.757293168,
    "n/mm²": 1e6,
    "n/mm2": 1e6,
    "n/mm^2": 1e6,
}
_NUMBER = {"": 1.0, "1": 1.0, "-": 1.0, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0}
_SHARE = {**_NUMBER, "%": 0.01, "percent": 0.01, "pct": 0.01, "prozent": 0.01}
_FORCE = {"n": 1.0, "kn": 1e3, "lbf": 4.4482216152605, "kgf": 9.80665, "gf": 9.80665e-3}
_LENGTH = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "µm": 1e-6, "um": 1e-6, "in": 0.0254}
#: Units of each quantity in SI.
UNITS = {
    "stretch": _NUMBER,
    "strain": _SHARE,
    "true strain": _SHARE,
    "stress": _STRESS,
    "true stress": _STRESS,
    "force": _FORCE,
    "displacement": _LENGTH,
}
_KNOWN_UNITS = {unit for units in UNITS.values() for unit in units if unit}
_BRACKETED = re.compile(r"^(.*?)[\[(<]\s*([^\[\](<>)]*?)\s*[\])>]\s*$")
_LETTERS = re.compile(r"[^\W\d_]+")


@dataclass(frozen=True)
class Column:
    """A column that is used.

    Parameters
    ----------
    name : in the file.
    quantity : one of `UNITS`.
    unit : as in the file, in lower case; empty if it names none.
    """

    name: str
    quantity: str
    unit: str

    @property
    def scale(self) -> float | None:
        """One unit in SI; None for a unit that the quantity does not have."""
        return UNITS[self.quantity].get(self.unit)


def column(name: str, unit_below: str = "") -> Column | None:
    """Return what a column holds, or None for one that is not used.

    Parameters
    ----------
    name : such as ``Engineering Stress (MPa)``, ``Dehnung [%]``, ``Kraft / N`` or ``strain_percent``.
    unit_below : unit in the line below the names, used where the name has none.
    """
    lower = name.strip().lower().replace("μ", "µ")
    rest, unit = _unit(lower)
    if not unit:
        bare = _BRACKETED.match(unit_below.strip().lower())
        unit = (bare[2] if bare else unit_below.strip().lower()).replace("μ", "µ")
    words = set(_LETTERS.findall(rest))
    if words & _OTHERS:
        return None
    found = [quantity for quantity, names in _WORDS.items() if words & names]
    if not found:
        return None
    quantity = _meant(found, unit)
    if quantity in ("strain", "stress") and words & _TRUE:
        quantity = f"true {quantity}"
    return Column(name.strip(), quantity, unit)


def _unit(name: str) -> tuple[str, str]:
    """Return the name without its unit, and the unit."""
    bracketed = _BRACKETED.match(name)
    if bracketed:
        return bracketed[1], bracketed[2]
    for separator in ("/", " in ", " ", "_"):
        rest, found, unit = name.rpartition(separator)
        if found and unit.strip() in _KNOWN_UNITS:
            return rest, unit.strip()
    return name, ""


def _meant(found: Iterable[str], unit: str) -> str:
    """Return the quantity that has this unit: an extension in % is a strain, a strain in mm an extension."""
    quantities = list(found)
    for quantity in [*quantities, *(["strain"] if "displacement" in quantities else ["displacement"])]:
        if unit and unit in UNITS[quantity]:
            return quantity
    return quantities[0]
