"""Does ``rodmodel-calibrate design`` take designs that nobody has tried to a calibration?

Run as ``python -m tests.benchmark.studies.random_designs [--designs 20] [--first 0] [--seed 0]
[--budget 20min] [--range] [--out runs/random_designs]``; ``--json`` for one object. Diameters are between 6
and 30 mm, walls differ by up to 30 % from the paper's in proportion, the silicone is one of four, the winding
any, and no pressure is named. ``--range`` stops before the mesh: it tells how far each design can be
pressurised, and takes a minute or two. A design that the checks refuse is drawn anew.
"""

import contextlib
import io
import json
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calibration.cli import main as calibrate
from calibration.from_design import Budget, StageError, Task
from calibration.from_design.pressure_range import find_range
from fem_reference import DesignError, parse_design
from tests.benchmark.studies.random_study import arguments, report

MATERIALS = ("dragon-skin-10", "dragon-skin-20", "ecoflex-00-30", "smooth-sil-950")
LAYOUTS = ("double-helix", "ring", "six-helix")
DIAMETERS_MM = (6.0, 30.0)
WALL_VARIATION = 0.3
# Lengths of the paper's actuator over its diameter, and pitches likewise.
_CAVITY, _WALLS, _BODY, _CAP, _WINDING = 1 / 6, (1 / 12, 1 / 8, 1.6 / 12), (4.0, 6.0), 0.5, 11.2 / 12
# Designs refused in a row that are no chance any more.
_REFUSED = 50
_PITCH, _THREAD = (0.15, 0.4), 0.0889 / 12


@dataclass(frozen=True)
class Drawn:
    """A design as text, with a line that describes it."""

    text: str
    line: str


def drawn(seed: int) -> Iterator[Drawn]:
    """Endless designs that the checks let pass."""
    rng, refused = np.random.default_rng(seed), 0
    while True:
        diameter = float(np.exp(rng.uniform(*np.log(DIAMETERS_MM))))
        outer, inner, partition = (
            diameter * wall * rng.uniform(1.0 - WALL_VARIATION, 1.0 + WALL_VARIATION) for wall in _WALLS
        )
        material, name = str(rng.choice(MATERIALS)), str(rng.choice(LAYOUTS))
        psi, pitch = math.degrees(rng.uniform(0.0, math.pi)), diameter * rng.uniform(*_PITCH)
        length = diameter * rng.uniform(*_BODY)
        advance = f"spacing_mm = {0.5 * pitch:.4g}" if name == "ring" else f"pitch_mm = {pitch:.4g}"
        turn = f"psi_deg = {psi:.4g}\n" if name == "double-helix" else ""
        text = f"""name = "random"

[dimensions]
body_diameter_mm = {diameter:.4g}
cavity_diameter_mm = {diameter * _CAVITY:.4g}
outer_wall_mm = {outer:.4g}
inner_wall_mm = {inner:.4g}
partition_wall_mm = {partition:.4g}
body_length_mm = {length:.4g}
cap_length_mm = {diameter * _CAP:.4g}
winding_diameter_mm = {min(diameter * _WINDING, diameter - outer):.4g}

[material]
name = "{material}"

[core]
young_modulus_mpa = 5

[thread]
name = "kevlar"
radius_mm = {diameter * _THREAD:.4g}

[winding]
layout = "{name}"
{turn}{advance}
"""
        line = (
            f"{diameter:.1f} mm, walls {outer:.2f} {inner:.2f} {partition:.2f} mm, {length:.0f} mm long, "
            f"{material}, {name} {turn.strip()} {advance}"
        )
        try:
            parse_design(text, "random")
        except DesignError:
            refused += 1
            if refused > _REFUSED:
                raise
            continue
        refused = 0
        yield Drawn(text, line)


def range_of(design: Drawn, folder: Path) -> dict[str, Any]:
    """How far a design can be pressurised."""
    task = Task(parse_design(design.text, "random"), Budget.parse("20min"), folder, "", workers=1)
    try:
        ends = find_range(task)
    except StageError as error:
        return {"good": False, "told": str(error)}
    told = "; ".join(
        f"{end.title} {1e-3 * end.pressure:.3g} kPa, {math.degrees(end.angle):.0f} deg, {end.reason}"
        for end in ends
    )
    return {"good": True, "told": told}


def calibration_of(design: Drawn, folder: Path, budget: str) -> dict[str, Any]:
    """What the command says of a design, with its exit status."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "design.toml"
    file.write_text(design.text)
    out, told = io.StringIO(), io.StringIO()
    command = ["design", str(file), "--out", str(folder / "law.json"), "--budget", budget, "--json"]
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(told):
        status = calibrate(command)
    record: dict[str, Any] = {"status": status, "good": status == 0, "told": told.getvalue().strip()}
    if status == 0:
        answer = json.loads(out.getvalue())
        record |= {key: answer[key] for key in ("bars", "bars_met", "notes", "judge")}
        bars = (
            f"{bar['name']} {bar['value']:.2f} of {bar['bar']:.2f} {bar['unit']}" for bar in answer["bars"]
        )
        record["told"] = "; ".join([*bars, *answer["notes"]])
    return record


def told(record: dict[str, Any]) -> str:
    """What became of a design, in two lines."""
    verdict = "good" if record["good"] else "FAILED"
    return f"{record['design']}: {verdict}, {record['seconds']:.0f} s\n    {record['told']}"


def main() -> None:
    """Draw designs, take each to its calibration or its range, and report."""
    parser = arguments(__doc__, 20)
    parser.add_argument("--budget", default="20min", help="time for each (default: %(default)s)")
    parser.add_argument("--range", action="store_true", help="tell the range of pressures alone")
    parser.add_argument("--out", type=Path, default=Path("runs/random_designs"), help="directory")
    options = parser.parse_args()

    def outcome(number: int, design: Drawn) -> dict[str, Any]:
        folder, begun = options.out / f"{options.seed}-{number:03d}", time.perf_counter()
        found = range_of(design, folder) if options.range else calibration_of(design, folder, options.budget)
        return {"design": design.line, **found, "seconds": round(time.perf_counter() - begun, 1)}

    summary = f"have a {'range' if options.range else 'calibration'}"
    report(options, drawn(options.seed), outcome, told, "good", summary)


if __name__ == "__main__":
    main()
