"""Where the full actuator left its loading branch, as part of a calibration file.

"jumps": [{"chamber": 1, 2 or 3, "stood_pa", "jumped_pa" (null if it stood to the end), "run", "mesh"}, ...]
"""

from dataclasses import dataclass
from typing import Any, final

from rodmodel.io.json_record import Record
from rodmodel.io.ranges import Range

_PRESSURE = Range(0.0, 1e8, "Pa")
_MOST = 64


@final
@dataclass(frozen=True)
class Jump:
    """A run of the full actuator whose pressure rises in one chamber alone.

    Attributes
    ----------
    chamber : number of the chamber, from 1.
    stood : largest pressure at which the run was on the loading branch [Pa].
    jumped : least pressure at which it had left it [Pa]; None for a run that ended before it did.
    run : name of the run.
    mesh : mesh of the run.
    """

    chamber: int
    stood: float
    jumped: float | None
    run: str
    mesh: str


def jumps_content(jumps: tuple[Jump, ...]) -> list[dict[str, Any]]:
    """Return the runs for JSON."""
    return [
        {
            "chamber": jump.chamber,
            "stood_pa": float(jump.stood),
            "jumped_pa": None if jump.jumped is None else float(jump.jumped),
            "run": jump.run,
            "mesh": jump.mesh,
        }
        for jump in jumps
    ]


def jumps_of(record: Record) -> tuple[Jump, ...]:
    """Return the runs of a file's record, none if it has none."""
    return record.each("jumps", _MOST, "run", _jump)


def _jump(record: Record) -> Jump:
    stood = float(record.take("stood_pa", _PRESSURE.expected, _is_pressure))
    jumped = record.take(
        "jumped_pa",
        f"a pressure above stood_pa, {stood:g} Pa, or null",
        lambda value: value is None or (_is_pressure(value) and value > stood),
    )
    return Jump(
        chamber=record.take("chamber", "1, 2 or 3", lambda value: type(value) is int and value in (1, 2, 3)),
        stood=stood,
        jumped=None if jumped is None else float(jumped),
        run=record.word("run"),
        mesh=str(
            record.take("mesh", "text, not empty", lambda value: isinstance(value, str) and value != "")
        ),
    )


def _is_pressure(value: Any) -> bool:
    return type(value) in (int, float) and _PRESSURE.holds(value)
