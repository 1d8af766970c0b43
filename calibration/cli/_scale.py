"""`rodmodel-calibrate scale`: the law of one actuator for another that is similar to it."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.cli._arguments import GOOD, BadInputError, Parser
from calibration.cli._files import read_calibration_file, write_calibration_file

if TYPE_CHECKING:
    from fem_reference import Design
    from rodmodel import Calibration

# Relative difference of two similar designs: what rounding to the digits of a drawing leaves.
_SIMILAR = 1e-4


def add_to(commands: "argparse._SubParsersAction[Parser]") -> Parser:
    """Add the command."""
    scale = commands.add_parser(
        "scale", help="write the calibration of an actuator that is similar to that of a file"
    )
    scale.add_argument("file", metavar="FILE", help="calibration file, of finite elements")
    scale.add_argument("--design", required=True, metavar="DESIGN", help="design file of the other actuator")
    scale.add_argument("--out", required=True, help="calibration file to write")
    scale.set_defaults(command=_scale)
    return scale


def _scale(options: argparse.Namespace, command: str) -> int:
    from calibration.from_design import design_of
    from calibration.provenance import code_version, sha256, today
    from calibration.similar import scaled
    from fem_reference import design_text, read_design, similarity

    calibration = read_calibration_file(options.file)
    if calibration.law.is_adjusted:
        raise BadInputError(
            f"{options.file}: got a law adjusted to measurements, expected the map that it was made of"
        )
    try:
        design = read_design(options.design)
    except (OSError, ValueError) as error:
        raise BadInputError(f"--design: {error}") from error
    source = design_of(calibration, design)
    found = similarity(design, source)
    if not found.within(_SIMILAR):
        raise BadInputError(f"--design {options.design}: {_unlike(found.deviations)}")
    scale = found.scale
    provenance = {
        **_origin(calibration, design),
        "design": design_text(design),
        "scaled": {
            "command": command,
            "code_version": code_version(),
            "date": today(),
            "file_sha256": sha256(Path(options.file)),
            "length": scale.length,
            "modulus": scale.modulus,
            "density": scale.density,
            "deviations": dict(found.deviations),
            "provenance": dict(calibration.provenance),
        },
    }
    result = scaled(calibration, scale, provenance)
    write_calibration_file(result, options.out)
    if options.json:
        import json

        print(json.dumps({"length": scale.length, "modulus": scale.modulus, "density": scale.density}))
    else:
        largest = max(result.domain.pressure_max)
        print(
            f"{options.out}: lengths × {scale.length:.6g}, moduli × {scale.modulus:.6g}; the same angles at "
            f"{scale.modulus:.6g} times the pressures, to {1e-3 * largest:.4g} kPa"
        )
    return GOOD


def _origin(calibration: "Calibration", design: "Design") -> dict[str, Any]:
    """Return what a fit near the result compares, and by how much the torsion was carried."""
    from dataclasses import asdict

    known = calibration.provenance
    return {
        "mesh": known.get("mesh"),
        "geometry_m": asdict(design.geometry),
        "material": {
            "body": asdict(design.material),  # type: ignore[call-overload]
            "core": asdict(design.core),
            "thread": asdict(design.thread),
        },
        **({"torsion": known["torsion"]} if "torsion" in known else {}),
    }


def _unlike(deviations: Any) -> str:
    """Say in what two designs differ, the largest differences first."""
    ordered = sorted(deviations.items(), key=lambda pair: -abs(pair[1]))[:4]
    told = ", ".join(f"{name} {100 * share:+.2g} %" for name, share in ordered)
    return (
        f"got a design that is not similar to that of the file ({told} of the scaled one), expected one "
        f"within {100 * _SIMILAR:g} %; sweep its cell (run --design), and fit near the file (fit --near)"
    )
