"""Actuator and domain of `rodmodel-calibrate run`: those of a design file, changed by options."""

import argparse
import math
from dataclasses import replace
from typing import TYPE_CHECKING

from calibration.cli._arguments import BadInputError
from calibration.cli._files import read_design_file
from calibration.cli._pressures import with_pressures

if TYPE_CHECKING:
    from fem_reference import Design, Winding
    from rodmodel import Domain


def orientations(options: argparse.Namespace) -> list[float]:
    """Return ψ [rad] of `--psi-deg`: none, one, or the least and the largest of many."""
    return [math.radians(value) for value in options.psi_deg or ()]


def run_actuator(options: argparse.Namespace) -> "Design":
    """Return the design of the file, or else the paper's, with what the options change.

    Its ends have the compliance that the sweep takes: that of the options, else of the design, else
    `usual_end_compliance`.

    Raises
    ------
    BadInputError
        For a file or a change that is impossible.
    """
    from calibration.sweep import usual_end_compliance
    from fem_reference import Design

    own = Design() if options.design is None else read_design_file("--design", options.design)
    layout = own.winding.name if options.layout is None else options.layout
    psi = orientations(options)
    if len(psi) > 2 or (len(psi) == 2 and not (layout == "double-helix" and psi[0] < psi[1])):
        raise BadInputError(
            f"--psi-deg: got {options.psi_deg} with --layout {layout}, expected one orientation, or "
            "for a double helix the least and the largest of many"
        )
    if any(psi) and not layout.endswith("helix"):
        raise BadInputError(
            f"--psi-deg: got {options.psi_deg[0]:g} with --layout {layout}, expected it for helices only"
        )
    compliance = own.end_compliance
    if options.end_compliance_mm_per_n is not None:
        compliance = 1e-3 * options.end_compliance_mm_per_n
    elif compliance is None:
        compliance = usual_end_compliance(own)
    changed = any(flag is not None for flag in (options.layout, options.psi_deg, options.pitch_mm))
    try:
        return replace(
            own,
            winding=_winding(options, own, psi) if changed else own.winding,
            end_compliance=compliance,
            name=f"{own.name}, changed" if changed else own.name,
        )
    except ValueError as error:
        raise BadInputError(f"--layout {layout}: {error}") from error


def _winding(options: argparse.Namespace, own: "Design", psi: list[float]) -> "Winding":
    from fem_reference import Ring, layout

    winding = own.winding
    cell = winding.cell_length(own.geometry.body_diameter)
    pitch = 2.0 * winding.spacing if isinstance(winding, Ring) else getattr(winding, "pitch", cell)
    return layout(
        winding.name if options.layout is None else options.layout,
        psi[0] if psi else getattr(winding, "psi", 0.0),
        pitch if options.pitch_mm is None else 1e-3 * options.pitch_mm,
    )


def run_domain(options: argparse.Namespace, actuator: "Design") -> "Domain":
    """Return the domain of the options; else the design's pressures; else that of all bodies, scaled."""
    from calibration.sweep import usual_moments
    from fem_reference.geometry import paper_number, paper_numbers
    from rodmodel import Domain

    units = actuator.units
    # Where neither design nor options tell them, the paper's in the body's megapascals (`Units`).
    usual = (units.megapascal * p for p in paper_numbers("pressures", "largest_kpa", -3))
    first, second, third = actuator.pressure_max or usual
    total = actuator.pressure_sum_max or units.megapascal * paper_number("pressures", "largest_sum_kpa", -3)
    moment, torque = usual_moments(actuator)
    if options.moment_max_nmm is not None:
        moment = 1e-3 * options.moment_max_nmm
    if options.torque_max_nmm is not None:
        torque = 1e-3 * options.torque_max_nmm
    return with_pressures(Domain((first, second, third), total, moment, torque), options)
