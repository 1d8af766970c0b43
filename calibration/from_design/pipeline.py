"""From a design to a calibration: all stages in their order, each from its files where these are there."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import xarray as xr

from calibration.from_design.actuator_runs import cases_for, run_actuators, time_limit
from calibration.from_design.ends_stage import end_compliance, ends_of, with_ends
from calibration.from_design.findings import Findings, draw_law, mesh_percent
from calibration.from_design.fit_stage import ITERATIONS, fitted
from calibration.from_design.judge_stage import bars, bound_of, rod_errors, summary
from calibration.from_design.mesh_check import MeshCheck, check_meshes, check_pressures
from calibration.from_design.near_law import NearLaw, near_laws
from calibration.from_design.pressure_range import (
    GIVEN,
    PathEnd,
    domain_of,
    find_range,
    first_compliance,
)
from calibration.from_design.stage_record import StageError, kept
from calibration.from_design.sweep_stage import expected_errors, paths_within, plan_of, sweep
from calibration.from_design.task import Task, level_title
from calibration.progress import Stages, stages_bar
from calibration.provenance import code_version, today
from fem_reference import design_text, level_record
from rodmodel import Calibration, Domain, shipped_calibrations

# Shares of the budget: what the fit takes, and the least that the sweep has.
_FIT, _SWEEP = 0.15, 0.3
# Time of a run of the full actuator in states of the first cell: half of them keep their plane.
_RUN = 400.0
# Distance from a shipped law's design up to which its law, scaled, is the design's own.
_SIMILAR = 1e-4
_STAGES = ("range", "mesh", "actuator runs", "sweep", "fit", "ends and bound", "report")

Say = Callable[[str], None]


def calibrate(task: Task, say: Say = print, iterations: int = ITERATIONS) -> Findings:
    """Make a calibration of a design, or go on with one that was interrupted.

    Parameters
    ----------
    task : what is asked for.
    say : takes lines that tell of a stage's result.
    iterations : of each fit.

    Returns
    -------
    findings : with the calibration; nothing is written outside of the task's directory.

    Raises
    ------
    StageError
        If a stage gives nothing to go on with.
    calibration.sweep.RunError
        If the directory of a sweep holds another run, or is damaged.
    """
    task.directory.mkdir(parents=True, exist_ok=True)
    budget = task.budget.seconds
    shares = dict(zip(_STAGES, (0.05, 0.05, 0.3, 0.4, _FIT, 0.04, 0.01), strict=True))
    with stages_bar({name: share * budget for name, share in shares.items()}) as stages:
        return _calibrate(task, say, iterations, stages)


@dataclass(frozen=True)
class _Begun:
    """Results of the stages before the sweep, with the mesh that was chosen; time of range and mesh [s]."""

    task: Task
    ends: tuple[PathEnd, ...]
    domain: Domain
    mesh: MeshCheck
    runs: xr.Dataset | None
    compliance: dict[str, Any]
    notes: list[str]
    seconds: float


def _calibrate(task: Task, say: Say, iterations: int, stages: Stages) -> Findings:
    near = near_laws(task.design)
    if near and near[0].distance < _SIMILAR:
        say(f"similar to {near[0].title}: `rodmodel-calibrate scale` gives the law of that for nothing")
    other = task.design.mirror_chamber
    if task.design.symmetry == "none" and other is not None:
        say(f"the section is its own mirror image at chamber {other}: numbered 1, it leaves half the work")
    begun = _begin(task, say, stages)
    task, notes = begun.task, begun.notes
    stages.begin("sweep")
    planned = _planned(task, begun, say)
    stages.expect("sweep", planned["seconds"])
    plan = plan_of(task, begun.domain, begun.compliance["value"], planned["paths"])
    dataset, file, failed = sweep(task, plan)
    if failed:
        notes.append(
            f"{len(failed)} of {planned['paths']} paths of the sweep ended early: {', '.join(failed)}."
        )
    say(f"sweep: {dataset.sizes['state']} states on {planned['paths']} paths")
    stages.begin("fit")
    law = fitted(task, dataset, file, begun.domain, near, iterations)
    if law.domain != begun.domain:
        notes.append(f"The law is stable inside a smaller domain: {law.domain.largest_pressures('kPa')}.")
    say(f"fit: {law.provenance['fit_start']}, {_held_out(law)}")
    stages.begin("ends and bound")
    calibration = _ended(task, begun, law, near, notes)
    errors = None if begun.runs is None else rod_errors(calibration, begun.runs, begun.mesh)
    length = task.design.geometry.body_length
    judged = {"states": 0, "judged": 0} if errors is None else summary(errors, length)
    if errors is not None and judged["judged"]:
        bound, note = bound_of(errors, calibration, near)
        if bound is None:
            notes.append("No shipped calibration states a bound: this one has none of its own either.")
        provenance = {**calibration.provenance, "bound": {**_about(task), **note}}
        calibration = replace(calibration, bound=bound, provenance=provenance)
    else:
        notes.append(
            "No judge state of the full actuator lies in the domain: the bound is that of the cell alone."
        )
    reached = bars(calibration, judged)
    origin = {"from_design": {**_origin(task, begun, planned), "bars": reached, "notes": notes}}
    calibration = replace(calibration, provenance={**calibration.provenance, **origin})
    for bar in reached:
        told = "" if bar["met"] else f": short of its bar of {bar['bar']:.3g}"
        say(f"{bar['name']}: {bar['value']:.2f} {bar['unit']}{told}")
    stages.begin("report")
    figures = task.directory / "figures"
    draw_law(calibration, dataset, figures, length)
    for line in notes:
        say(f"note: {line}")
    return Findings(
        task, begun.ends, begun.mesh, planned, calibration, errors, judged, reached, notes, figures
    )


def _begin(task: Task, say: Say, stages: Stages) -> _Begun:
    """Run the stages before the sweep: range, mesh, runs of the full actuator."""
    notes: list[str] = []
    clock = time.monotonic()
    stages.begin("range")
    ends = find_range(task)
    domain = domain_of(task.design, ends)
    for end in ends:
        say(
            f"range: {end.title} to {1e-3 * end.pressure:.4g} kPa and {math.degrees(end.angle):.1f} deg: "
            f"{end.detail}"
        )
        if task.design.pressure_max is not None and end.reason != GIVEN:
            notes.append(
                f"{end.title}: on the first mesh, {end.detail} at {1e-3 * end.pressure:.3g} kPa, below the "
                "design's pressure."
            )
    say(f"range: {domain.largest_pressures('kPa')}")
    stages.begin("mesh")
    mesh = _meshes(task, domain)
    if mesh.cheaper and task.levels.cheaper is not None:
        task = replace(task, meshes=replace(task.levels, sweep=task.levels.cheaper))
    percent = mesh_percent(mesh)
    say(
        f"mesh: {level_title(task.levels.sweep)}; its angles are off those of "
        f"{level_title(task.levels.finer)} by {percent['one_chamber_percent']:.2f} % (one chamber) and "
        f"{percent['two_chambers_percent']:.2f} % (two)"
    )
    if not task.budget.converged and task.meshes is None:
        say("mesh: coarse, as budgets below 1h have no time for the mesh near its limit")
    seconds = time.monotonic() - clock
    stages.begin("actuator runs")
    cases = cases_for(task, domain)
    try:
        runs, failed = run_actuators(task, cases)
    except StageError as error:
        runs, failed = None, {}
        notes.append(f"{error}; the ends are those of the most similar shipped calibration.")
    notes += [
        f"The run {name} of the full actuator ended early: {reason}." for name, reason in failed.items()
    ]
    compliance: dict[str, Any]
    if runs is None:
        compliance = {"value": first_compliance(task.design), "from": "similar actuators"}
    else:
        compliance = kept(
            task.directory,
            "end-compliance",
            {"design": design_text(task.design), "tips": runs["tip_position"].values.tolist()},
            lambda: end_compliance(task.design, runs),
        )
    say(f"end compliance: {1e3 * compliance['value']:.3g} mm/N, from {compliance['from']}")
    return _Begun(task, ends, domain, mesh, runs, compliance, notes, seconds)


def _meshes(task: Task, domain: Domain) -> MeshCheck:
    levels, compliance = task.levels, first_compliance(task.design)
    inputs = {
        "design": design_text(task.design),
        "pressures": check_pressures(domain),
        "end_compliance": compliance,
        "meshes": [level_record(level) for level in (levels.sweep, levels.finer, levels.actuator)],
        "cheaper": None if levels.cheaper is None else level_record(levels.cheaper),
    }
    record = kept(task.directory, "mesh", inputs, lambda: check_meshes(task, domain, compliance).record())
    found = MeshCheck.of(record)
    if not all(map(math.isfinite, (*found.sweep, found.seconds))):
        raise StageError(
            f"mesh: the cell did not converge on {level_title(levels.sweep)} at three quarters of the range"
        )
    return found


def _planned(task: Task, begun: _Begun, say: Say) -> dict[str, Any]:
    """Return the number of paths for the budget, and what to expect of it."""
    compliance = begun.compliance["value"]
    plan = plan_of(task, begun.domain, compliance, 1)
    first = sum(end.seconds for end in begun.ends) / len(begun.ends)
    inputs = {
        "run": plan.description(),
        "budget": task.budget.seconds,
        "seconds_per_state": begun.mesh.seconds,
        "first": first,
    }

    def chosen() -> dict[str, Any]:
        number = len(cases_for(task, begun.domain))
        runs = min(number * _RUN * first / task.workers, time_limit(task))
        others = begun.seconds + _FIT * task.budget.seconds + runs
        seconds = max(0.9 * task.budget.seconds - others, _SWEEP * task.budget.seconds)
        paths = paths_within(plan, begun.mesh.seconds, seconds, task.workers)
        states = sum(len(path.loads) for path in replace(plan, paths=paths).design())
        return {"paths": paths, "states": states, "seconds": seconds, "seconds_per_state": begun.mesh.seconds}

    planned = kept(task.directory, "plan", inputs, chosen)
    rows = expected_errors(shipped_calibrations())
    say(
        f"sweep: {planned['paths']} paths, some {planned['states']} states at "
        f"{planned['seconds_per_state']:.2g} s; held-out errors of free bending (95 %, of the range) that "
        "laws of ours have, roughly:"
    )
    for row in rows:
        near = ", near another law" if row["near"] else ""
        say(f"  {row['states']:5d} states  {row['free_bending_percent']:.2f} %{near}")
    if planned["states"] < rows[0]["states"]:
        say("  fewer states than any of these: expect more")
    return {**planned, "expected": rows}


def _ended(
    task: Task, begun: _Begun, law: Calibration, near: tuple[NearLaw, ...], notes: list[str]
) -> Calibration:
    """Return the law with ends: fitted, or those of the most similar shipped calibration."""
    first = near[0] if near else None
    ends, compliance = None, begun.compliance["value"]
    if begun.runs is not None:
        ends = ends_of(task.design, begun.runs, compliance, law.domain)
    if ends is None and begun.runs is not None:
        notes.append(
            "Too few fit runs of the full actuator in the domain: the ends are those of the most similar "
            "calibration."
        )
    if ends is not None and (ends.after > ends.before or ends.turn_after > ends.turn_before):
        notes.append(
            f"The fitted ends do not explain the fit runs: they leave {1e3 * ends.after:.2f} mm and "
            f"{math.degrees(ends.turn_after):.2f} deg at the tip; without them it is "
            f"{1e3 * ends.before:.2f} mm and {math.degrees(ends.turn_before):.2f} deg."
        )
    return with_ends(law, ends, first, begun.compliance, _about(task))


def _about(task: Task) -> dict[str, Any]:
    return {"command": task.command, "code_version": code_version(), "date": today()}


def _origin(task: Task, begun: _Begun, planned: dict[str, Any]) -> dict[str, Any]:
    """Return what the calibration's provenance tells of the stages before the fit."""
    percent = mesh_percent(begun.mesh)
    return {
        **_about(task),
        "budget_s": task.budget.seconds,
        "range": [
            {"chambers": list(end.chambers), "pressure_pa": end.pressure, "ends_at": end.reason}
            for end in begun.ends
        ],
        "mesh_check": {
            **begun.mesh.record(),
            "meshes": [level_record(level) for level in (task.levels.sweep, task.levels.finer)],
            **{key: value if math.isfinite(value) else None for key, value in percent.items()},
        },
        "paths": planned["paths"],
    }


def _held_out(law: Calibration) -> str:
    row = law.error.get("free_bending_angle_rad")
    if row is None:
        return "no held-out state of free bending"
    percent = 100.0 * row["p95"] / row["range"] if row["range"] else math.nan
    return f"held-out free bending, 95 %: {math.degrees(row['p95']):.2f} deg, {percent:.2f} % of the range"
