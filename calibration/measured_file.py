"""The adjustment file: parameters found from measurements, and a rod with them.

{"schema": "rodmodel-adjustment", "version": 1,
 "layout": {"name", "psi_rad", "pitch_m"},
 "wall": {"radius_m", "thickness_m", "shear_modulus_pa"},
 "parameters": {"stiffness_scale", "pressure_gain_1" ..., "pressure_offset_1_pa" ..., "wall_variation_1" ...},
 "standard_errors": {the same; null where held},
 "provenance": {...}}
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calibration.adjusted_law import NAMES, OuterWall, adjusted_rod
from rodmodel import Layout, load

SCHEMA, VERSION = "rodmodel-adjustment", 1
KEYS = tuple(f"{name}_pa" if "offset" in name else name for name in NAMES)


@dataclass(frozen=True)
class Adjustment:
    """Parameters in the order and units of `NAMES`, their errors (NaN where held), and whose they are."""

    layout: Layout
    wall: OuterWall
    parameters: np.ndarray
    standard_errors: np.ndarray
    provenance: dict[str, Any]

    def rod(self, calibration: str | Path | None = None) -> Any:
        """Rod of the layout with the parameters; `calibration` as the path of `rodmodel.load`."""
        of_map = load(self.layout.name, self.layout.psi or 0.0, self.layout.pitch, calibration)
        return adjusted_rod(of_map, self.parameters, self.wall)


def save_adjustment(adjustment: Adjustment, path: str | Path) -> None:
    """Write the file; a parameter that is not finite raises `ValueError` and writes nothing."""
    layout, wall = adjustment.layout, adjustment.wall
    errors = [None if math.isnan(error) else float(error) for error in adjustment.standard_errors]
    content = {
        "schema": SCHEMA,
        "version": VERSION,
        "layout": {"name": layout.name, "psi_rad": layout.psi, "pitch_m": layout.pitch},
        "wall": {
            "radius_m": wall.radius,
            "thickness_m": wall.thickness,
            "shear_modulus_pa": wall.shear_modulus,
        },
        "parameters": dict(zip(KEYS, map(float, adjustment.parameters), strict=True)),
        "standard_errors": dict(zip(KEYS, errors, strict=True)),
        "provenance": adjustment.provenance,
    }
    text = json.dumps(content, allow_nan=False, indent=1)
    Path(path).write_text(text + "\n", encoding="utf-8")


def read_adjustment(path: str | Path) -> Adjustment:
    """Read the file.

    Raises
    ------
    ValueError
        One line that names the file, what came and what is expected.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        if (content["schema"], content["version"]) != (SCHEMA, VERSION):
            raise ValueError(f"schema {content['schema']!r}, version {content['version']!r}")
        layout, wall = content["layout"], content["wall"]
        errors = [content["standard_errors"][key] for key in KEYS]
        found = Adjustment(
            Layout(str(layout["name"]), float(layout["psi_rad"]), float(layout["pitch_m"])),
            OuterWall(float(wall["radius_m"]), float(wall["thickness_m"]), float(wall["shear_modulus_pa"])),
            np.array([float(content["parameters"][key]) for key in KEYS]),
            np.array([math.nan if error is None else float(error) for error in errors]),
            dict(content["provenance"]),
        )
        if not (np.all(np.isfinite(found.parameters)) and np.all(found.parameters[:4] > 0.0)):
            raise ValueError("parameters that are not finite, or a scale or gain that is not positive")
    except KeyError as error:
        raise ValueError(f"{path}: got no key {error}, expected a file of fit-measured") from error
    except (OSError, TypeError, ValueError) as error:
        raise ValueError(f"{path}: got {error}, expected a file of fit-measured") from error
    return found
