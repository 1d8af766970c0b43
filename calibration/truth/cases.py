"""Runs of the full actuator for the comparison with rods, and their roles.

Roles were assigned before any fit: ``fit`` runs calibrate the ends, ``judge`` runs are held out. On one
winding no load has both roles. After the judge runs had shown where the rod has its largest errors, fit runs
were added: the pair 2+3, two unequal pairs and six triples, two runs at a pitch of 6 mm, and two of six
helices. Pairs at other orientations were added as judge runs, then fit runs to the ends of the range, and
last judge runs on a path on which cells lean over, which maps err most on.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

from fem_reference import ActuatorLoad, Winding, layout
from rodmodel import Layout

Triple = tuple[float, float, float]
Role = Literal["fit", "judge"]
GRAVITY = 9.81
_EACH: tuple[Triple, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_PAIRS: dict[str, Triple] = {"12": (1.0, 1.0, 0.0), "23": (0.0, 1.0, 1.0), "31": (1.0, 0.0, 1.0)}
# Pressure shares, within the laws' domain at 45 kPa; mirror images would be redundant.
_MIXTURES: tuple[Triple, ...] = (
    (0.2, 1.0, 1.0),
    (1.0, 0.6, 0.6),
    (0.4, 1.0, 0.8),
    (1.0, 1.0, 0.2),
    (0.3, 1.0, 0.3),
    (0.8, 0.2, 1.0),
    (0.5, 0.0, 1.0),
    (0.0, 0.5, 1.0),
)
# Pressure shares of a held-out path of the sweeps, on which most cells lean over from 47 kPa on.
_LEANS: Triple = (1.0, 0.338, 0.395)


@dataclass(frozen=True)
class TruthCase:
    """Path of loads on one winding, from rest.

    Parameters
    ----------
    name : name of the run and its directory.
    role : ``fit`` or ``judge``.
    winding : layout of the thread.
    loads : loads in order, each of a state of the truth.
    symmetric : whether to impose mirror symmetry. A free body may leave its plane above 50 kPa, and takes
        twice the time below.
    """

    name: str
    role: Role
    winding: Winding
    loads: tuple[ActuatorLoad, ...]
    symmetric: bool = False


# Cases with equal pressures in chambers 2 and 3, and a mirror-symmetric winding.
_SYMMETRIC = (
    *(
        "chamber1-fit",
        "chamber1-high-fit",
        "pair23-fit",
        "pair23-high-fit",
        "mixture-0.2-1-1-fit",
        "mixture-1-0.6-0.6-fit",
    ),
    *("chamber1", "pair23", "pitch2-chamber1", "pitch4-chamber1"),
    *("pitch6-chamber1", "ring-chamber1", "six-helix-chamber1", "six-helix-chamber1-fit"),
    *("ring-pair23", "six-helix-pair23"),
)


@cache
def cases() -> tuple[TruthCase, ...]:
    """Return all cases."""
    zero = layout("double-helix")
    named: list[tuple[str, Role, Winding, tuple[ActuatorLoad, ...]]] = [
        # Calibration of the ends.
        ("chamber1-fit", "fit", zero, _ramp((1.0, 0.0, 0.0), (10, 20, 30, 40, 50))),
        ("chamber2-fit", "fit", zero, _ramp((0.0, 1.0, 0.0), (10, 20, 30, 40, 50))),
        ("pair12-fit", "fit", zero, _ramp((1.0, 1.0, 0.0), (10, 20, 30, 40))),
        ("pair23-fit", "fit", zero, _ramp((0.0, 1.0, 1.0), (10, 20, 30, 40))),
        ("triple-fit", "fit", zero, _ramp((1.0, 0.5, 0.2), (10, 20, 30, 40))),
        *(
            (
                f"mixture-{first:g}-{second:g}-{third:g}-fit",
                "fit",
                zero,
                _ramp((first, second, third), (15, 30, 45)),
            )
            for first, second, third in _MIXTURES
        ),
        # Beyond it, as far as a single section keeps upright.
        ("chamber1-high-fit", "fit", zero, _ramp((1.0, 0.0, 0.0), (53, 58, 63, 68))),
        ("chamber2-high-fit", "fit", zero, _ramp((0.0, 1.0, 0.0), (53, 57))),
        ("pair23-high-fit", "fit", zero, _ramp((0.0, 1.0, 1.0), (47, 52))),
        ("force-fit", "fit", zero, _loaded((20.0, 0.0, 0.0), [((0.0, 0.03, 0.0), (0.0, 0.0, -GRAVITY))])),
        # Single chambers to beyond the snap of walls, and pairs beyond a half turn.
        ("chamber1", "judge", zero, _ramp((1.0, 0.0, 0.0), (5, 15, 25, 35, 45, 55, 60, 65, 70))),
        ("chamber2", "judge", zero, _ramp((0.0, 1.0, 0.0), (5, 15, 25, 35, 45, 55, 60, 65, 70))),
        ("chamber3", "judge", zero, _ramp((0.0, 0.0, 1.0), (5, 15, 25, 35, 45, 55, 60, 65, 70))),
        ("pair12", "judge", zero, _ramp(_PAIRS["12"], (5, 15, 25, 35, 45, 50))),
        ("pair23", "judge", zero, _ramp(_PAIRS["23"], (5, 15, 25, 35, 45, 50, 55, 57))),
        ("pair31", "judge", zero, _ramp(_PAIRS["31"], (5, 15, 25, 35, 45, 50))),
        # Three unequal pressures.
        ("triple-40-20-10", "judge", zero, _ramp((1.0, 0.5, 0.25), (15, 25, 35, 45))),
        ("triple-25-45-5", "judge", zero, _ramp((0.55, 1.0, 0.11), (15, 25, 35, 45))),
        ("triple-10-30-35", "judge", zero, _ramp((0.29, 0.86, 1.0), (15, 25, 35))),
        # Tip force and gravity at several pressures: upright, hanging and lying.
        ("force-upright-0", "judge", zero, _loaded((0.0, 0.0, 0.0), _forces((0.0, 0.0, -GRAVITY)))),
        ("force-upright-25", "judge", zero, _loaded((25.0, 0.0, 0.0), _forces((0.0, 0.0, -GRAVITY)))),
        ("force-hanging-40", "judge", zero, _loaded((0.0, 40.0, 0.0), _forces((0.0, 0.0, GRAVITY)))),
        ("force-lying-30-30", "judge", zero, _loaded((30.0, 30.0, 0.0), _forces((GRAVITY, 0.0, 0.0)))),
    ]
    for psi in (30.0, 45.0, 90.0):
        winding = layout("double-helix", math.radians(psi))
        for k, way in enumerate(_EACH, start=1):
            named.append((f"psi{psi:g}-chamber{k}", "judge", winding, _ramp(way, (15, 30, 45, 60, 70))))
        for pair, both in _PAIRS.items():
            named.append((f"psi{psi:g}-pair{pair}", "judge", winding, _ramp(both, (15, 30, 45, 50))))
    for name, winding in (("", zero), ("psi90-", layout("double-helix", math.pi / 2.0))):
        named.append((f"{name}triple-51-17-20", "judge", winding, _ramp(_LEANS, (15, 30, 41, 46, 51))))
    wide = layout("double-helix", 0.0, 6e-3)
    named += [
        # The ends fitted at a pitch of 3 mm are too stiff for 6 mm.
        ("pitch6-chamber2-fit", "fit", wide, _ramp((0.0, 1.0, 0.0), (10, 20, 30, 40, 50))),
        ("pitch6-pair12-fit", "fit", wide, _ramp((1.0, 1.0, 0.0), (10, 20, 30, 40))),
    ]
    for pitch in (2e-3, 4e-3, 6e-3):
        winding = layout("double-helix", 0.0, pitch)
        named.append(
            (f"pitch{1e3 * pitch:g}-chamber1", "judge", winding, _ramp((1.0, 0.0, 0.0), (15, 30, 45, 60, 70)))
        )
    for name in ("ring", "six-helix"):
        named.append(
            (f"{name}-chamber1", "judge", layout(name), _ramp((1.0, 0.0, 0.0), (15, 30, 45, 60, 70)))
        )
        # All pairs of these windings are alike, and this one has a plane of symmetry.
        named.append((f"{name}-pair23", "judge", layout(name), _ramp(_PAIRS["23"], (15, 30, 45, 50))))
    six = layout("six-helix")
    named += [
        ("six-helix-pair12", "judge", six, _ramp(_PAIRS["12"], (15, 30, 45, 50))),
        # Six helices need ends of their own too.
        ("six-helix-chamber1-fit", "fit", six, _ramp((1.0, 0.0, 0.0), (10, 20, 40, 50))),
        ("six-helix-pair12-fit", "fit", six, _ramp((1.0, 1.0, 0.0), (10, 20, 35, 42))),
    ]
    return tuple(TruthCase(*row, symmetric=row[0] in _SYMMETRIC) for row in named)


def _pascals(kpa: Sequence[float]) -> Triple:
    first, second, third = (1e3 * p for p in kpa)
    return first, second, third


def _ramp(way: Sequence[float], levels_kpa: Sequence[int]) -> tuple[ActuatorLoad, ...]:
    """Return pressures in fixed proportion."""
    return tuple(ActuatorLoad(_pascals([level * w for w in way])) for level in levels_kpa)


def _loaded(kpa: Sequence[float], loads: Sequence[tuple[Triple, Triple]]) -> tuple[ActuatorLoad, ...]:
    """Return tip forces [N] and gravity [m/s²] at one pressure."""
    return tuple(ActuatorLoad(_pascals(kpa), tip_force=force, gravity=gravity) for force, gravity in loads)


def _forces(gravity: Triple) -> list[tuple[Triple, Triple]]:
    """Return no force, one along x, one along y, and an oblique one."""
    return [
        ((0.0, 0.0, 0.0), gravity),
        ((0.03, 0.0, 0.0), gravity),
        ((0.0, 0.05, 0.0), gravity),
        ((-0.02, 0.02, 0.02), gravity),
    ]


def layout_of(winding: Winding) -> Layout:
    """Return name, orientation and pitch of a winding; the pitch of rings is twice their spacing."""
    pitch = getattr(winding, "pitch", None) or 2.0 * getattr(winding, "spacing", math.nan)
    return Layout(winding.name, getattr(winding, "psi", 0.0), pitch)


def same_layout(one: Layout, other: Layout) -> bool:
    """Return whether two layouts have the same name, pitch and ψ, or are both of all ψ."""
    if one.name != other.name or not math.isclose(one.pitch, other.pitch):
        return False
    if one.psi is None or other.psi is None:
        return one.psi is other.psi
    return math.isclose(one.psi, other.psi, abs_tol=1e-9)


def title(layout: Layout) -> str:
    """Return the title of a layout, such as "double-helix, pitch 3 mm, ψ = 0°"."""
    parts = [layout.name, f"pitch {1e3 * layout.pitch:g} mm"]
    if layout.name == "double-helix":
        parts.append("any ψ" if layout.psi is None else f"ψ = {math.degrees(layout.psi):g}°")
    return ", ".join(parts)
