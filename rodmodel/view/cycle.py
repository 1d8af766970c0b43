"""A cycle of pressures as a JSON object and a table."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rodmodel.view.text import prediction_record

if TYPE_CHECKING:
    import rodmodel.control

_COLUMNS = f"{'pressures [kPa]':>22s}  {'angle [deg]':>11s}  {'plane [deg]':>11s}  branch"


def cycle_record(pressure: np.ndarray, found: Sequence["rodmodel.control.BranchSolution"]) -> dict[str, Any]:
    """Return states under pressures (n, 3) [Pa] in their order as a JSON object."""
    states = [
        {
            "pressure_kpa": [float(p) for p in 1e-3 * row],
            "jumped": state.jumped,
            **prediction_record(state.solution, state),
        }
        for row, state in zip(pressure, found, strict=True)
    ]
    return {"states": states}


def cycle_text(record: dict[str, Any]) -> str:
    """Return the table of a cycle's record; jumps and states of no calibrated branch are marked."""
    lines = [_COLUMNS]
    for state in record["states"]:
        pressures = " ".join(f"{p:7.2f}" for p in state["pressure_kpa"])
        angle, plane = (
            f"{'–' if state[key] is None else format(state[key], '.2f'):>11s}"
            for key in ("bending_angle_deg", "bending_plane_deg")
        )
        where = state["branch"] or "outside the calibration"
        if state["snapped_by_chamber"] is not None:
            sign = "+" if state["snapped_side"] > 0 else "-"
            where += f", chamber {state['snapped_by_chamber']}{sign}"
        notes = [", jumped"] * state["jumped"] + [", another possible"] * state["other_branch_possible"]
        lines.append(f"{pressures:>22s}  {angle}  {plane}  {where}{''.join(notes)}")
    return "\n".join(lines)
