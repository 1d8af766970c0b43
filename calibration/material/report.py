"""Table, record and design lines of a material fit."""

import math
from typing import Any

from calibration.material.choice import FittedLaw, MaterialFit
from fem_reference.materials import Material, Ogden, Yeoh

_MPA = 1e6
_NEO_HOOKEAN, _MOONEY_RIVLIN = (2.0,), (2.0, -2.0)


def material_table(material: Material) -> dict[str, Any]:
    """Return the keys of a design file's material table.

    Raises
    ------
    ValueError
        For a law that a design file does not hold.
    """
    table: dict[str, Any]
    if isinstance(material, Yeoh):
        table = {"model": "yeoh", "constants_mpa": [_mpa(c) for c in material.constants]}
    elif not isinstance(material, Ogden):
        raise ValueError(f"material: got {type(material).__name__}, expected Ogden or Yeoh")
    elif material.exponents == _NEO_HOOKEAN:
        table = {"model": "neo-hookean", "shear_moduli_mpa": [_mpa(material.shear_modulus)]}
    elif material.exponents == _MOONEY_RIVLIN:
        table = {"model": "mooney-rivlin", "constants_mpa": [_mpa(0.5 * mu) for mu in material.shear_moduli]}
    else:
        table = {
            "model": "ogden",
            "convention": "abaqus",
            "shear_moduli_mpa": [_mpa(mu) for mu in material.shear_moduli],
            "exponents": list(material.exponents),
        }
    if material.stretch_range is not None:
        table["stretch_range"] = list(material.stretch_range)
    return table


def material_lines(material: Material, source: str) -> str:
    """Return the lines of a design file's material table."""
    table = {**material_table(material), "source": source}
    return "\n".join(["[material]", *(f"{key} = {_toml(value)}" for key, value in table.items())])


def fit_table(fit: MaterialFit) -> str:
    """Return a table of all laws, with the chosen one marked."""
    rows: list[tuple[str, ...]] = [
        ("", "law", "constants", "off [%]", "largest [%]", "held out [%]", "initial shear modulus [kPa]")
    ]
    rows += [_row(law, law is fit.chosen) for law in fit.laws]
    widths = [max(len(row[n]) for row in rows) for n in range(len(rows[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if n < 2 else cell.rjust(width)
            for n, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


def fit_record(fit: MaterialFit) -> dict[str, Any]:
    """Return the fit for a program: the chosen law's table and all candidates."""
    return {
        "chosen": fit.chosen.name,
        "material": {**material_table(fit.material), "source": fit.source},
        "shear_modulus_kpa": fit.material.shear_modulus / 1e3,
        "laws": [
            {
                "name": law.name,
                "constants": law.constants,
                "material": None if law.material is None else material_table(law.material),
                "error": law.error,
                "largest_error": law.largest,
                "held_out_error": law.held_out,
            }
            for law in fit.laws
        ],
        "tests": [
            {
                "file": test.name,
                "mode": test.mode,
                "rows": len(test.stretch),
                "stretch_range": [float(test.stretch.min()), float(test.stretch.max())],
            }
            for test in fit.tests
        ],
        "notes": list(fit.notes),
        "doubts": list(fit.doubts),
    }


def _row(law: FittedLaw, chosen: bool) -> tuple[str, ...]:
    if law.material is None:
        return ("", law.name, str(law.constants), "-", "-", "-", "-")

    def percent(value: float) -> str:
        return f"{100.0 * value:.2f}" if math.isfinite(value) else "-"

    return (
        "*" if chosen else "",
        law.name,
        str(law.constants),
        percent(law.error),
        percent(law.largest),
        percent(law.held_out),
        f"{law.material.shear_modulus / 1e3:.4g}",
    )


def _mpa(pascals: float) -> float:
    """Return a stress in MPa without the digits that the division adds."""
    return float(f"{pascals / _MPA:.12g}")


def _toml(value: Any) -> str:
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{escaped}"'
    if isinstance(value, list):
        return f"[{', '.join(_toml(one) for one in value)}]"
    return repr(value)
