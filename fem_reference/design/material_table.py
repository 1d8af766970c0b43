"""The [material] table of a design file, and the law that it stands for."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from fem_reference.design.kinds import KeysError
from fem_reference.materials import SILICONES, Material, Ogden, Yeoh, mooney_rivlin, neo_hookean

#: Function that fits a law to the CSV file of a test.
FitMaterial = Callable[[Path], "Silicone"]
# Keys that say what the material is, of which a table has one.
_WAYS = ("name", "model", "test")
# Keys of constants, which go with a model only.
_CONSTANTS = ("convention", "shear_moduli", "exponents", "constants", "bulk_modulus", "stretch_range")


class Silicone(NamedTuple):
    """A material and where its constants are from."""

    law: Material
    source: str = ""


def silicone_of(given: Mapping[str, Any], folder: Path, fit: FitMaterial | None) -> Silicone:
    """Return the material of a table.

    Parameters
    ----------
    given : values in SI by argument, see `tables.TABLES`.
    folder : of the design's file, beside which a test's file lies.
    fit : fits a law to a test; None where no test is taken.

    Raises
    ------
    KeysError
        For keys that do not belong together, or stand for no material.
    ValueError
        From the law itself, with the name of its argument.
    """
    ways = [way for way in _WAYS if way in given]
    if len(ways) != 1:
        got = " and ".join(ways) or "none of them"
        raise KeysError(tuple(ways) or ("model",), f"got {got}, expected one of {', '.join(_WAYS)}")
    (way,) = ways
    if way != "model":
        for argument in _CONSTANTS:
            if argument in given:
                raise KeysError((argument,), f"got it beside {way}, expected it beside model only")
    if way == "model":
        found = Silicone(_law(given))
    elif way == "name":
        published = SILICONES[given["name"]]
        found = Silicone(published.material, published.source)
    else:
        found = _tested(folder / given["test"], fit)
    return found._replace(source=given.get("material_source", found.source))


def material_arguments(law: Material) -> dict[str, Any]:
    """Return the table's values in SI, by argument, that stand for a law."""
    if isinstance(law, Ogden):
        own: dict[str, Any] = {
            "model": "ogden",
            "convention": "abaqus",
            "shear_moduli": law.shear_moduli,
            "exponents": law.exponents,
        }
    elif isinstance(law, Yeoh):
        own = {"model": "yeoh", "constants": law.constants}
    else:
        raise ValueError(f"material: got {type(law).__name__}, expected Ogden or Yeoh")
    return {**own, "bulk_modulus": law.bulk_modulus, "stretch_range": law.stretch_range}


def _law(given: Mapping[str, Any]) -> Material:
    model = given["model"]
    needed, build = _MODELS[model]
    for argument in _CONSTANTS[:4]:
        if argument in given and argument not in needed:
            raise KeysError((argument,), f"got it for the model {model}, expected it without")
    missing = tuple(argument for argument in needed if argument not in given)
    if missing:
        raise KeysError(missing, f"got nothing, expected it for the model {model}")
    return build(given, given.get("bulk_modulus"), given.get("stretch_range"))


_Range = tuple[float, float] | None


def _ogden(given: Mapping[str, Any], bulk: float | None, tested: _Range) -> Material:
    moduli, exponents = given["shear_moduli"], given["exponents"]
    if len(moduli) != len(exponents):
        raise KeysError(
            ("shear_moduli", "exponents"),
            f"got {len(exponents)} of them for {len(moduli)} moduli, expected one for each",
        )
    if given["convention"] == "classic":
        return Ogden.classic(moduli, exponents, bulk, tested)
    return Ogden(moduli, exponents, bulk, tested)


def _neo_hookean(given: Mapping[str, Any], bulk: float | None, tested: _Range) -> Material:
    (modulus,) = _so_many(given, "shear_moduli", 1)
    return neo_hookean(modulus, bulk, tested)


def _mooney_rivlin(given: Mapping[str, Any], bulk: float | None, tested: _Range) -> Material:
    c10, c01 = _so_many(given, "constants", 2)
    try:
        return mooney_rivlin(c10, c01, bulk, tested)
    except ValueError as error:
        names, _, message = str(error).partition(": ")
        if names in ("c10 and c01", "shear_moduli"):
            raise KeysError(("constants",), message) from error
        raise


def _yeoh(given: Mapping[str, Any], bulk: float | None, tested: _Range) -> Material:
    return Yeoh(given["constants"], bulk, tested)


def _so_many(given: Mapping[str, Any], argument: str, count: int) -> tuple[float, ...]:
    values: tuple[float, ...] = given[argument]
    if len(values) != count:
        raise KeysError((argument,), f"got {len(values)} numbers, expected {count} for {given['model']}")
    return values


_Build = Callable[[Mapping[str, Any], float | None, _Range], Material]
#: By model: arguments that it needs, and how it is built.
_MODELS: Mapping[str, tuple[tuple[str, ...], _Build]] = {
    "ogden": (("convention", "shear_moduli", "exponents"), _ogden),
    "neo-hookean": (("shear_moduli",), _neo_hookean),
    "mooney-rivlin": (("constants",), _mooney_rivlin),
    "yeoh": (("constants",), _yeoh),
}


def _tested(file: Path, fit: FitMaterial | None) -> Silicone:
    if fit is None:
        raise KeysError(
            ("test",),
            f"got {file.name!r}, expected a model and its constants here; "
            f"`rodmodel-design fit-material {file.name}` prints them",
        )
    if not file.is_file():
        raise KeysError(("test",), f"got {str(file)!r}, expected a file that is there")
    return fit(file)
