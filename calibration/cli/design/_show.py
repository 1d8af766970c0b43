"""`rodmodel-design show`: a design in derived numbers, compared with another one, and as a picture."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.cli._arguments import GOOD, BadInputError, Parser, json_text, refuse_unwritable
from calibration.cli._files import read_design_file

if TYPE_CHECKING:
    from fem_reference import Design, MeshLevel, Similarity

_PICTURES = (".pdf", ".png", ".svg")
_MM, _KPA = 1e3, 1e-3
# Designs that deviate less are similar for all purposes.
_TOLERANCE = 1e-6


def add_to(commands: "argparse._SubParsersAction[Parser]") -> Parser:
    """Add the command."""
    parser = commands.add_parser("show", help="print what follows from a design, and draw it")
    add = parser.add_argument
    add("design", metavar="FILE", help="design file, see docs/reference/design_file.md")
    add("--like", default=None, metavar="FILE", help="design to compare with (default: the paper's)")
    add("--plot", default=None, metavar="FILE", help="picture to write: PNG, PDF or SVG")
    parser.set_defaults(command=_run)
    return parser


def _run(options: argparse.Namespace, command: str) -> int:
    from fem_reference import Design, design_figure, design_text, similarity
    from rodmodel.io import atomic_part

    design = read_design_file("FILE", options.design)
    other = Design() if options.like is None else read_design_file("--like", options.like)
    if options.plot is not None:
        if Path(options.plot).suffix.lower() not in _PICTURES:
            raise BadInputError(f"--plot: got {options.plot!r}, expected a .pdf, .png or .svg file")
        refuse_unwritable("--plot", Path(options.plot))
    numbers, alike = _numbers(design), similarity(design, other)
    if options.json:
        print(json_text({**numbers, "like": _comparison(alike, other), "toml": design_text(design)}))
    else:
        print(_text(design, numbers, alike, other))
    if options.plot is not None:
        with atomic_part(options.plot) as part:
            kind = Path(options.plot).suffix[1:].lower()
            design_figure(design, _level(design)).savefig(part, dpi=150, format=kind)
    return GOOD


def _level(design: "Design") -> "MeshLevel | None":
    """Return the mesh that the design's cell takes, or None where gmsh is not installed."""
    try:
        from fem_reference import converged_level, mesh_level
    except (ImportError, OSError):
        return None
    return mesh_level(converged_level(design.winding))


def _numbers(design: "Design") -> dict[str, Any]:
    """Return what follows from a design, in the units of its file."""
    geometry, thread, winding = design.geometry, design.thread, design.winding
    disc = math.pi / 4.0 * geometry.body_diameter**2
    hole = math.pi / 4.0 * geometry.cavity_diameter**2
    body = design.density * geometry.body_length * (geometry.body_area + hole)
    cap = design.density * geometry.cap_length * disc
    length = geometry.body_length + (geometry.cap_length if design.cap_wound else 0.0)
    lines = winding.polylines(geometry.winding_diameter / 2.0, length, 360)
    steps = [((line[1:] - line[:-1]) ** 2).sum(axis=1) ** 0.5 for line in lines]
    around = math.pi * geometry.winding_diameter
    pitch = getattr(winding, "pitch", 0.0 if lines else None)
    return {
        "name": design.name,
        "layout": winding.name,
        "shear_modulus_kpa": _KPA * design.material.shear_modulus,
        "bulk_to_shear": design.material.bulk_modulus / design.material.shear_modulus,
        "stretch_range": design.material.stretch_range,
        "chamber_area_mm2": [_MM**2 * area for area in geometry.chamber_areas],
        "silicone_area_mm2": _MM**2 * geometry.body_area,
        "least_outer_wall_mm": _MM * (geometry.body_diameter / 2.0 - max(geometry.chamber_outer_radii)),
        "mass_g": 1e3 * (body + cap),
        "cap_mass_g": 1e3 * cap,
        "core_bending_stiffness_nmm2": 1e6 * design.core.bending_stiffness(geometry.cavity_diameter),
        "thread_angle_deg": None if pitch is None else math.degrees(math.atan2(around, pitch)),
        "threads": len(lines),
        "thread_length_mm": _MM * float(sum(step.sum() for step in steps)),
        "thread_axial_stiffness_n": thread.axial_stiffness if lines else None,
        "winding_period_mm": _MM * winding.period if lines else None,
        "pressure_max_kpa": None if design.pressure_max is None else [_KPA * p for p in design.pressure_max],
    }


def _comparison(alike: "Similarity", other: "Design") -> dict[str, Any]:
    return {
        "name": other.name,
        "similar": alike.within(_TOLERANCE),
        "length": alike.length,
        "modulus": alike.modulus,
        "pressure": alike.pressure,
        "moment": alike.moment,
        "force": alike.force,
        "deviations": dict(alike.deviations),
    }


def _text(design: "Design", numbers: dict[str, Any], alike: "Similarity", other: "Design") -> str:
    geometry = design.geometry
    tested = numbers["stretch_range"]
    areas = ", ".join(f"{area:.4g}" for area in dict.fromkeys(numbers["chamber_area_mm2"]))
    rows = [
        ("body", f"{_MM * geometry.body_diameter:g} mm × {_MM * geometry.body_length:g} mm"),
        ("cap", f"{_MM * geometry.cap_length:g} mm"),
        ("chamber area", f"{areas} mm²"),
        ("silicone area", f"{numbers['silicone_area_mm2']:.4g} mm²"),
        ("mass", f"{numbers['mass_g']:.4g} g, of which the cap {numbers['cap_mass_g']:.3g} g"),
        ("shear modulus", f"{numbers['shear_modulus_kpa']:.4g} kPa"),
        ("bulk over shear", f"{numbers['bulk_to_shear']:.4g}"),
        ("tested stretch", "not known" if tested is None else f"{tested[0]:g} to {tested[1]:g}"),
        ("core", f"bending stiffness {numbers['core_bending_stiffness_nmm2']:.4g} N mm²"),
    ]
    if numbers["threads"]:
        rows += [
            (
                "winding",
                f"{numbers['layout']}, {numbers['thread_angle_deg']:.4g}° from the axis, repeats every "
                f"{numbers['winding_period_mm']:g} mm",
            ),
            (
                "threads",
                f"{numbers['threads']}, {_MM * design.thread.diameter:.4g} mm thick, "
                f"{numbers['thread_length_mm']:.4g} mm in all, EA "
                f"{numbers['thread_axial_stiffness_n']:.4g} N",
            ),
        ]
    else:
        rows.append(("winding", "none"))
    if design.pressure_max is not None and design.pressure_sum_max is not None:
        each = ", ".join(f"{p:g}" for p in numbers["pressure_max_kpa"])
        rows.append(("pressures", f"up to {each} kPa, {_KPA * design.pressure_sum_max:g} kPa in sum"))
    body = "\n".join(f"{name:16s}{value}" for name, value in rows)
    return f"{design.name}\n{body}\n{_similarity_text(alike, other)}"


def _similarity_text(alike: "Similarity", other: "Design") -> str:
    scales = f"lengths × {alike.length:.4g}, moduli × {alike.modulus:.4g}"
    if alike.within(_TOLERANCE):
        return (
            f"similar to {other.name}: {scales}, pressures × {alike.pressure:.4g}, moments × "
            f"{alike.moment:.4g}, forces × {alike.force:.4g}"
        )
    largest = sorted(alike.deviations.items(), key=lambda item: -abs(item[1]))
    differ = ", ".join(f"{name} {100.0 * deviation:+.3g} %" for name, deviation in largest)
    return f"not similar to {other.name}: with {scales}, these differ: {differ}"
