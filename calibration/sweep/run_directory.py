"""What a run of the cell was asked for, kept beside its results."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from calibration.provenance import code_version, today
from calibration.sweep.design import ROUNDS, LoadingPath, design_paths
from calibration.sweep.run_schema import RUN_KEYS
from fem_reference import (
    ActuatorGeometry,
    MeshLevel,
    Ogden,
    RecordError,
    Thread,
    Winding,
    level_record,
    read_record,
)
from rodmodel import Domain
from rodmodel.io import drop_parts, write_atomically

# Of a path, from a load to the next [Pa]: a law needs many paths rather than many states of each.
PRESSURE_STEP = 8e3
#: In a run's directory, what it was asked for.
RUN_FILE = "run.json"
#: By how much the ends of the paper's actuator give [m/N]: `ends`, from its own runs.
END_COMPLIANCE = 0.23e-3


class RunError(ValueError):
    """A run directory that is damaged, or holds something else than what was asked for."""


@dataclass(frozen=True)
class RunPlan:
    """Actuator, mesh level, domain and design of a run."""

    geometry: ActuatorGeometry
    winding: Winding
    level: str | MeshLevel
    """By name, or element counts of your own."""
    domain: Domain
    paths: int
    seed: int
    end_compliance: float = END_COMPLIANCE
    """See `PeriodCell` [m/N]."""
    orientations: tuple[float, float] | None = None
    """Least and largest ψ [rad] where every path has its own; that of the winding is then of no account."""

    def __post_init__(self) -> None:
        if any(self.geometry.outer_wall_variation):
            raise ValueError(
                f"geometry: got an outer_wall_variation of {self.geometry.outer_wall_variation}, expected "
                "none: a law has the symmetry of a section with equal walls"
            )

    @property
    def mirror(self) -> bool:
        """Whether the section is its own mirror image in the plane of chamber 1."""
        return self.orientations is None and self.winding.mirror_symmetric

    def design(self) -> tuple[LoadingPath, ...]:
        """The loading paths, in the order in which to run them."""
        return design_paths(self.domain, self.paths, self.seed, self.mirror, PRESSURE_STEP, self.orientations)

    def description(self) -> dict[str, Any]:
        """All of it as JSON, for the run directory and the attributes of the dataset."""
        own = {}
        if self.orientations is not None:
            own = {"orientations": list(self.orientations), "rounds": ROUNDS}
        lengths = asdict(self.geometry)
        del lengths["outer_wall_variation"]
        return {
            **own,
            "layout": self.winding.name,
            "winding": asdict(self.winding),
            "geometry": lengths,
            "body_area_m2": self.geometry.body_area,
            "mesh": level_record(self.level),
            "end_compliance": self.end_compliance,
            "domain": asdict(self.domain),
            "seed": self.seed,
            "mirror": self.mirror,
            "pressure_step": PRESSURE_STEP,
        }


def whole_material(material: Mapping[str, Any]) -> dict[str, Any]:
    """What a file says of the materials, with what was not yet a choice when it was written, by default."""
    every = json.loads(json.dumps({"body": asdict(Ogden()), "thread": asdict(Thread())}))
    return {**material, **{part: {**every[part], **material[part]} for part in every if part in material}}


def refuse_another(
    found: Mapping[str, Any], plan: RunPlan, material: Mapping[str, Any], where: str, expected: str
) -> None:
    """Raise a `RunError` where a run's description, found somewhere, is not of this plan."""
    wanted = json.loads(json.dumps({**plan.description(), "material": material}))
    found = {**found, "material": whole_material(found.get("material", {}))}
    for key, value in wanted.items():
        if found.get(key) != value:
            raise RunError(
                f"{where} holds a run with {key} {found.get(key)}, this one has {value}; "
                f"expected {expected} of the same run"
            )


def open_run(directory: Path, plan: RunPlan, command: str, material: Mapping[str, Any]) -> dict[str, Any]:
    """Begin a run directory, or take up one that was begun with the same plan (more paths may be asked for).

    Returns
    -------
    description, with the date of the run's beginning, its commands and their code versions.

    Raises
    ------
    RunError
        If the directory holds a run of another plan, or its file is damaged.
    """
    file, wanted = directory / RUN_FILE, {**plan.description(), "material": material}
    directory.mkdir(parents=True, exist_ok=True)
    # Of this run's own killed processes: a directory belongs to one run.
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
