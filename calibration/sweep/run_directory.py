"""Run directory of a sweep: the plan of the run, stored with its results."""

import itertools
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from calibration.provenance import code_version, today
from calibration.sweep.design import ROUNDS, LoadingPath, design_paths, paths_around
from calibration.sweep.run_schema import RUN_KEYS
from fem_reference import (
    ActuatorGeometry,
    Core,
    Design,
    MeshLevel,
    Ogden,
    RecordError,
    Thread,
    Winding,
    design_text,
    level_record,
    read_record,
)
from fem_reference.geometry import paper_number
from rodmodel import Domain
from rodmodel.io import drop_parts, write_atomically

# Pressure step between loads of a path, in the body's megapascals (`Units`): a law needs many paths rather
# than many states per path.
_PRESSURE_STEP = 8e-3
#: File with the description of a run, in its directory.
RUN_FILE = "run.json"
# Compliance of the ends, in the body's millimetres per newton, as `calibration.ends` fits it to the paper's
# actuator.
_END_COMPLIANCE = paper_number("ends", "compliance_mm_per_n")
# Largest bending moment and torque on a section, in the body's newton millimetres.
_MOMENT, _TORQUE = 6.6, 3.3


class RunError(ValueError):
    """Error for a run directory that is damaged, or holds another run."""


@dataclass(frozen=True)
class RunPlan:
    """Actuator, mesh level, domain and design of a run."""

    actuator: Design
    """What the sections are made of. The ends' compliance is the plan's own."""
    level: str | MeshLevel
    """Name of a level, or element counts."""
    domain: Domain
    paths: int
    seed: int
    end_compliance: float
    """See `PeriodCell` [m/N]."""
    orientations: tuple[float, float] | None = None
    """Range of ψ [rad] from which each path draws its own orientation; the winding's ψ is then ignored."""
    around: int | None = None
    """Number of the chamber in whose neighbourhood all paths lie."""

    def __post_init__(self) -> None:
        if self.orientations is not None and len(set(self.geometry.outer_wall_variation)) > 1:
            raise ValueError(
                f"geometry: got an outer_wall_variation of {self.geometry.outer_wall_variation}, expected "
                "none: a law of all orientations has the symmetry of a section with equal walls"
            )

    @property
    def geometry(self) -> ActuatorGeometry:
        """Dimensions of the actuator."""
        return self.actuator.geometry

    @property
    def winding(self) -> Winding:
        """Winding of the actuator."""
        return self.actuator.winding

    @property
    def material(self) -> dict[str, Any]:
        """Constants of silicone, thread and core, for the run directory and the dataset's attributes."""
        actuator = self.actuator
        return {
            # A dataclass, as all laws are.
            "body": asdict(actuator.material),  # type: ignore[call-overload]
            "thread": asdict(actuator.thread),
            "core": asdict(actuator.core),
        }

    @property
    def pressure_step(self) -> float:
        """Largest change of a pressure between loads of a path [Pa]."""
        return _PRESSURE_STEP * self.actuator.units.megapascal

    @property
    def mirror(self) -> bool:
        """Whether the section is mirror-symmetric in the plane of chamber 1."""
        return self.orientations is None and self.actuator.symmetry != "none"

    def design(self) -> tuple[LoadingPath, ...]:
        """Return the loading paths in the order in which to run them."""
        if self.around is not None:
            return paths_around(self.domain, self.around, self.paths, self.seed, self.pressure_step)
        return design_paths(
            self.domain, self.paths, self.seed, self.pressure_step, self.mirror, self.orientations
        )

    def description(self) -> dict[str, Any]:
        """Return the plan for JSON, for the run directory and the dataset's attributes."""
        own: dict[str, Any] = {}
        if self.orientations is not None:
            own = {"orientations": list(self.orientations), "rounds": ROUNDS}
        if self.around is not None:
            own["around"] = self.around
        lengths = asdict(self.geometry)
        if not any(lengths["outer_wall_variation"]):
            del lengths["outer_wall_variation"]
        return {
            **own,
            "layout": self.winding.name,
            "winding": asdict(self.winding),
            "geometry": lengths,
            "body_area_m2": self.geometry.body_area,
            "mesh": level_record(self.level),
            "end_compliance": self.end_compliance,
            "domain": _domain_record(self.domain),
            "seed": self.seed,
            "mirror": self.mirror,
            "pressure_step": self.pressure_step,
            "design": design_text(self.actuator),
        }


def usual_moments(actuator: Design) -> tuple[float, float]:
    """Return the largest bending moment and torque of a sweep [N m]: the paper's, scaled."""
    units = actuator.units
    return _MOMENT * units.newton / units.metre, _TORQUE * units.newton / units.metre


def usual_end_compliance(actuator: Design) -> float:
    """Return the compliance of an actuator's ends where nothing tells it [m/N]: the paper's, scaled."""
    units = actuator.units
    return _END_COMPLIANCE / units.metre / units.newton


def _domain_record(domain: Domain) -> dict[str, Any]:
    """Return a domain for JSON, without limits that it does not have."""
    record = asdict(domain)
    if math.isinf(domain.beside_max):
        del record["beside_share"], record["beside_max"]
    if not any(domain.pressure_min):
        del record["pressure_min"]
    if not any(domain.single_max):
        del record["single_max"], record["single_beside"]
    return record


def whole_material(material: Mapping[str, Any]) -> dict[str, Any]:
    """Return a file's material with defaults for parameters that older files lack."""
    every = {"body": asdict(Ogden()), "thread": asdict(Thread())}
    if "constants" in material.get("body", {}):
        # A law that older files do not know.
        del every["body"]
    filled = {part: {**every[part], **material[part]} for part in every if part in material}
    if filled:
        filled["core"] = material.get("core", asdict(Core()))
    return {**material, **json.loads(json.dumps(filled))}


def refuse_another(
    found: Mapping[str, Any], plan: RunPlan, material: Mapping[str, Any], where: str, expected: str
) -> None:
    """Raise a `RunError` if the description of a run does not match this plan."""
    wanted = json.loads(json.dumps({**plan.description(), "material": material}))
    found = {**found, "material": whole_material(found.get("material", {}))}
    # Older files hold no design: all of one that a run depends on is in their other keys.
    found.setdefault("design", wanted["design"])
    for key, value in wanted.items():
        if found.get(key) != value and key == "design":
            raise RunError(
                f"{where} holds a run of another design ({_first_difference(found[key], value)}); expected "
                f"{expected} of the same run"
            )
        if found.get(key) != value:
            raise RunError(
                f"{where} holds a run with {key} {found.get(key)}, this one has {value}; "
                f"expected {expected} of the same run"
            )


def _first_difference(found: str, wanted: str) -> str:
    """Return the first lines of two designs' texts that differ."""
    pairs = itertools.zip_longest(found.splitlines(), wanted.splitlines(), fillvalue="nothing")
    own, other = next(pair for pair in pairs if pair[0] != pair[1])
    return f"{own}, this one has {other}"


def open_run(directory: Path, plan: RunPlan, command: str, material: Mapping[str, Any]) -> dict[str, Any]:
    """Create a run directory, or resume one with the same plan (the number of paths may be larger).

    Returns
    -------
    description : with the date of the run's start, its commands and their code versions.

    Raises
    ------
    RunError
        If the directory holds a run of another plan, or its file is damaged.
    """
    file, wanted = directory / RUN_FILE, {**plan.description(), "material": material}
    directory.mkdir(parents=True, exist_ok=True)
    # A directory belongs to one run, so these parts come from its killed processes.
    drop_parts(directory)
    if file.exists():
        try:
            found = read_record(file, RUN_KEYS)
        except RecordError as error:
            raise RunError(f"--out: {error}") from error
        refuse_another(found, plan, material, f"--out: {directory}", "an empty directory or one")
        for name, value in (("command", command), ("code_version", code_version())):
            if value not in found[name].split("; "):
                found[name] += f"; {value}"
        write_atomically(file, json.dumps(found, indent=1) + "\n")
        return found
    description = {**wanted, "command": command, "code_version": code_version(), "date": today()}
    write_atomically(file, json.dumps(description, indent=1) + "\n")
    return description
