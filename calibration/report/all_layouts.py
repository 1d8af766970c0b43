"""Tables of all shipped laws against the cell, and of their rods against the full actuator."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from calibration.provenance import sha256
from calibration.report.law_report import judge
from calibration.sweep import DatasetError, attributes, load_dataset
from calibration.truth import Verdict, case_of, judgement, layout_of, on_its_mesh, title
from rodmodel import Calibration, Domain


@dataclass(frozen=True)
class MapReport:
    """Errors of a law against the cell.

    Parameters
    ----------
    calibration : calibration of the law.
    error : held-out errors from `calibration.fit.held_out_error.figures`.
    recomputed : whether the errors come from the law's dataset instead of its file.
    """

    calibration: Calibration
    error: Mapping[str, Any]
    recomputed: bool


def datasets_by_checksum(directory: Path) -> dict[str, Path]:
    """Return all netCDF files of a directory, by the checksums that calibration files contain.

    Raises
    ------
    DatasetError
        If there is none.
    """
    found = {sha256(file): file for file in sorted(directory.glob("*.nc"))}
    if not found:
        raise DatasetError(f"datasets: got {directory}, expected a directory with netCDF files of `run`")
    return found


def report_map(calibration: Calibration, datasets: Mapping[str, Path], figures: Path | None) -> MapReport:
    """Return the held-out errors of a law, and draw plots if its dataset is available.

    Parameters
    ----------
    calibration : calibration of the law.
    datasets : files from `datasets_by_checksum`.
    figures : directory for a subdirectory of the law's plots, or None for no plots.
    """
    file = datasets.get(calibration.provenance.get("dataset_sha256", ""))
    if file is None:
        return MapReport(calibration, calibration.error, recomputed=False)
    dataset = load_dataset(file)
    length = attributes(dataset)["geometry"]["body_length"]
    own = None if figures is None else figures / file.stem
    mine = on_its_mesh(calibration)
    error = judge(mine.section_law, dataset, mine.domain, length, own)
    return MapReport(calibration, error, recomputed=True)


def report_rods(verdict: Verdict, role: str = "judge") -> dict[str, dict[str, Any]]:
    """Return the errors of a role's runs, by the title of each winding with a rod, and for ``all``."""
    titles = {name: title(layout_of(case_of(name).winding)) for name in dict.fromkeys(verdict.case)}
    found = {}
    for winding in dict.fromkeys(titles.values()):
        figures = judgement(verdict, role, [name for name in titles if titles[name] == winding])
        if figures["judged"]:
            found[winding] = figures
    return {**found, "all": judgement(verdict, role)}


def markdown(
    maps: Sequence[MapReport], rods: Mapping[str, Mapping[str, Any]], shares: Mapping[str, Any]
) -> str:
    """Return the tables of maps, of rods and of the bounds' coverage in Markdown."""
    lines = [
        "# Errors of maps and rods",
        "",
        "What `rodmodel-calibrate report --datasets calibration/datasets` prints.",
        "",
        "## Map against cell",
        "",
        "Held-out states: loading paths that no fit has seen. Median / 95th percentile / worst; angles over "
        "the body's length, moments and volumes as a part of their range over these states.",
        "",
        "| law | pressures to [kPa] | ridges | states that train, on paths | held out, on paths "
        "| free bending [deg] | with its plane [deg] | under moment [deg] | moment, 95 % | volume, 95 % "
        "| free bending is worst at [kPa] |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in maps:
        domain = row.calibration.domain
        limits = ", ".join(f"{1e-3 * p:g}" for p in domain.pressure_max)
        worst = row.error["free_bending_angle_rad"].get("worst_at", {}).get("pressure_pa", [])
        training = row.calibration.provenance.get("training", {})
        cells = [
            title(row.calibration.layout) + ("" if row.recomputed else " (as its file states)"),
            f"{limits}; {1e-3 * domain.pressure_sum_max:g} in sum{_beside(domain)}",
            str(training.get("ridges", "—")),
            _counts(training),
            _counts(row.error),
            *(
                _three(row.error.get(key), math.degrees(1.0))
                for key in ("free_bending_angle_rad", "free_bending_vector_rad", "loaded_bending_angle_rad")
            ),
            *(_share(row.error.get(key)) for key in ("moment_nm", "volume_m2")),
            " ".join(f"{1e-3 * p:.1f}" for p in worst) or "—",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    lines += [
        "",
        "## Rod against full actuator",
        "",
        "Judge runs, states inside the rod's domain. Median / 95th percentile / worst; the tip's distance in "
        "percent of the body's length, θ up to 150°.",
        "",
        "| winding | states | tip [%] | θ [deg] | γ [deg] | tip under loads [%] | volumes [mm³] "
        "| tip is worst at |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for winding, figures in rods.items():
        cells = [winding, f"{figures['judged']} of {figures['states']}"]
        cells += [
            _three(figures.get(key), 1.0)
            for key in ("tip_percent", "angle_deg", "plane_deg", "loaded_tip_percent", "volume_mm3")
        ]
        at = figures.get("tip_percent", {}).get("worst_at")
        cells.append(
            "—" if at is None else f"{at['case']}, {' '.join(f'{p:g}' for p in at['pressure_kpa'])} kPa"
        )
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", *_coverage_lines(shares)]) + "\n"


def _coverage_lines(shares: Mapping[str, Any]) -> list[str]:
    """Return the section on the bounds' coverage."""
    lines = [
        "## Coverage of the stated 90 % bounds",
        "",
        "Distinct judge states inside the rod's domain, against the limit of fine meshes; by calibration and "
        "by fifth of the pressures' sum.",
        "",
        "| states of | states | θ within | tip within |",
        "| --- | --- | --- | --- |",
    ]
    for name, row in coverage_rows(shares):
        inside = ("—" if row[key] is None else f"{100.0 * row[key]:.0f} %" for key in ("angle", "tip"))
        lines.append(f"| {name} | {row['states']} | {' | '.join(inside)} |")
    return lines


def coverage_rows(shares: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """Return the rows of `calibration.truth.coverage_by` with their names."""
    fifths = [row for row in shares["fifths"] if row["states"]]
    return [
        *shares["layouts"].items(),
        *(("{:.3g} to {:.3g} kPa in sum".format(*row["pressure_sum_kpa"]), row) for row in fifths),
        ("all", shares["all"]),
    ]


def _beside(domain: Domain) -> str:
    if math.isinf(domain.beside_max):
        return ""
    return f"; {1e-3 * domain.beside_max:g} in each with {domain.beside_share:.3g} of the others"


def _counts(row: Mapping[str, Any]) -> str:
    return f"{row['states']}, {row['paths']}" if "states" in row and "paths" in row else "—"


def _three(row: Mapping[str, Any] | None, factor: float) -> str:
    if row is None:
        return "—"
    return " / ".join(f"{factor * row[key]:.2f}" for key in ("median", "p95", "worst"))


def _share(row: Mapping[str, Any] | None) -> str:
    return "—" if row is None or "range" not in row else f"{100.0 * row['p95'] / row['range']:.1f} %"
