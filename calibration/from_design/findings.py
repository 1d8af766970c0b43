"""What a calibration from a design has found, in JSON and as a page."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from calibration.fit import deviations, loading_samples, prepare
from calibration.from_design.figures import png, range_figure, rod_figure
from calibration.from_design.judge_stage import RodErrors
from calibration.from_design.mesh_check import MeshCheck
from calibration.from_design.pressure_range import PathEnd
from calibration.from_design.task import Task, level_title
from calibration.report import Section, error_table, page, pairs, write_figures
from calibration.sweep import inside
from fem_reference import design_text, level_record
from rodmodel import Calibration

# Figures of the law, as `calibration.report.write_figures` names them.
_OF_THE_LAW = ("angle-against-pressure", "parity", "error-over-states", "moment-curvature")


@dataclass(frozen=True)
class Findings:
    """Results of all stages.

    Parameters
    ----------
    task : what was asked for.
    ends : ends of the range of pressures.
    mesh : angles on several meshes.
    plan : paths of the sweep, and what they are expected to give.
    calibration : as written.
    errors : rod against the runs of the full actuator; None without a run.
    judged, bars : errors of the judge runs, and what was to be reached.
    notes : what went another way than it should.
    figures : folder of the law's figures.
    """

    task: Task
    ends: tuple[PathEnd, ...]
    mesh: MeshCheck
    plan: Mapping[str, Any]
    calibration: Calibration
    errors: RodErrors | None
    judged: Mapping[str, Any]
    bars: Sequence[Mapping[str, Any]]
    notes: Sequence[str]
    figures: Path

    @property
    def short(self) -> list[str]:
        """What is short of its bar, or not known."""
        unknown = [] if self.judged.get("judged") else ["judge runs, none of which lies in the domain"]
        return [bar["name"] for bar in self.bars if not bar["met"]] + unknown

    def record(self) -> dict[str, Any]:
        """Return the findings for JSON, in kPa and degrees."""
        domain = self.calibration.domain
        return {
            "range": [
                {
                    "chambers": list(end.chambers),
                    "pressure_kpa": 1e-3 * end.pressure,
                    "angle_deg": math.degrees(end.angle),
                    "ends_at": end.reason,
                    "detail": end.detail,
                }
                for end in self.ends
            ],
            "pressure_max_kpa": [1e-3 * p for p in domain.pressure_max],
            "pressure_sum_max_kpa": 1e-3 * domain.pressure_sum_max,
            "beside_share": domain.beside_share,
            "beside_max_kpa": 1e-3 * domain.beside_max if math.isfinite(domain.beside_max) else None,
            "mesh": {"level": level_record(self.task.levels.sweep), **mesh_percent(self.mesh)},
            "plan": dict(self.plan),
            "error": dict(self.calibration.error),
            "judge": dict(self.judged),
            "bars": [dict(bar) for bar in self.bars],
            "bars_met": not self.short,
            "notes": list(self.notes),
        }


def mesh_percent(mesh: MeshCheck) -> dict[str, float]:
    """Return by how much the sweep's angles are off those of the finer mesh, in percent."""
    return {"one_chamber_percent": 100.0 * mesh.error(1), "two_chambers_percent": 100.0 * mesh.error(2)}


def draw_law(calibration: Calibration, dataset: xr.Dataset, figures: Path, length: float) -> None:
    """Draw a law against the states of its sweep, as PNG in a folder."""
    law, domain = calibration.section_law, calibration.domain
    samples = loading_samples(dataset)
    everything = samples.where(inside(domain, samples.pressure, samples.moment))
    held_out = prepare(dataset, domain, length).held_out
    write_figures(figures, law, everything, held_out, deviations(law, held_out, length), length)


def report(found: Findings) -> str:
    """Return the report as an HTML page."""
    design, calibration = found.task.design, found.calibration
    sections = [_verdict(found), _range(found), _mesh(found), _law(found), _rod(found)]
    sections.append(Section("Design").code(design_text(design)))
    sections.append(
        Section("Provenance").table(("what", "value"), pairs(_without(calibration.provenance, "design")))
    )
    return page(f"Calibration of {design.name}", sections)


def _verdict(found: Findings) -> Section:
    section = Section("What it reaches").table(
        ("", "reached", "bar", "met"),
        [
            (
                bar["name"],
                f"{bar['value']:.2f} {bar['unit']}",
                f"{bar['bar']:g}",
                "yes" if bar["met"] else "no",
            )
            for bar in found.bars
        ],
    )
    for note in found.notes:
        section.text(note)
    return section


def _range(found: Findings) -> Section:
    section = Section("Range of pressures").table(
        ("chambers", "kPa", "deg", "ends at"),
        [
            (end.title, f"{1e-3 * end.pressure:.4g}", f"{math.degrees(end.angle):.1f}", end.detail)
            for end in found.ends
        ],
    )
    section.text(f"Domain of the law: {found.calibration.domain.largest_pressures('kPa')}.")
    return section.figure("angle over pressure", png(range_figure(found.ends)))


def _mesh(found: Findings) -> Section:
    mesh, levels = found.mesh, found.task.levels
    rows = []
    for name, level, angles in (
        ("sweep", levels.sweep, mesh.sweep),
        ("finer", levels.finer, mesh.finer),
        ("full actuator", levels.actuator, mesh.actuator),
    ):
        rows.append((name, level_title(level), *(f"{math.degrees(a):.3f}" for a in angles)))
    loads = [" ".join(f"{1e-3 * p:.3g}" for p in pressure) + " kPa [deg]" for pressure in mesh.pressures]
    percent = mesh_percent(mesh)
    return (
        Section("Mesh")
        .table(("mesh of", "level", *loads), rows)
        .text(
            f"The sweep's angles are off those of the finer mesh by {percent['one_chamber_percent']:.2f} % "
            f"with one chamber, and by {percent['two_chambers_percent']:.2f} % with two."
        )
    )


def _law(found: Findings) -> Section:
    plan, provenance = found.plan, found.calibration.provenance
    section = Section("Sweep and law").text(
        f"{plan['paths']} paths; {provenance['states']} states; fitted {provenance['fit_start']}."
    )
    table = [line.strip("| ").split(" | ") for line in error_table(found.calibration.error).splitlines()]
    rows = [row for row in table if len(row) > 1]
    section.table(rows[0], rows[2:])
    for name in _OF_THE_LAW:
        file = found.figures / f"{name}.png"
        if file.exists():
            section.figure(name, file.read_bytes())
    return section


def _rod(found: Findings) -> Section:
    section = Section("Rod against the full actuator")
    actuator = found.calibration.actuator
    section.table(
        ("end", "value"),
        [
            ("turn of the base [mrad/kPa]", f"{1e6 * float(actuator.base_turn):.4g}"),
            ("lag of the base [mm]", f"{1e3 * float(actuator.base_lag):.4g}"),
            ("stiff tip [mm]", f"{1e3 * float(actuator.stiff_tip):.4g}"),
            ("largest offset of the cap [mm]", f"{1e3 * float(actuator.tip_offset):.4g}"),
            ("draw of the cap [mm3]", f"{1e9 * float(actuator.tip_draw):.4g}"),
            ("held length of the chambers [mm]", f"{1e3 * float(actuator.held_length):.4g}"),
        ],
    )
    if found.errors is None:
        return section.text("There is no run of the full actuator.")
    errors, rows = found.errors, []
    length = float(actuator.body_length)
    for state in np.flatnonzero(errors.role == "judge"):
        pressures = " ".join(f"{1e-3 * p:.3g}" for p in errors.pressure[state])
        rows.append(
            (
                f"{errors.case[state]}, {pressures} kPa",
                f"{math.degrees(errors.angle[state]):.1f}",
                f"{math.degrees(errors.angle_error[state]):.2f}",
                f"{100.0 * errors.tip_error[state] / length:.2f}",
                "yes" if errors.judged[state] else "no",
            )
        )
    head = ("judge run", "angle [deg]", "off by [deg]", "tip off by [% of length]", "in the domain")
    section.table(head, rows)
    return section.figure("rod against actuator", png(rod_figure(errors, found.calibration.bound)))


def _without(content: Mapping[str, Any], key: str) -> dict[str, Any]:
    return {name: value for name, value in content.items() if name != key}
