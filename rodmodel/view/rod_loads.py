"""Arrows for the loads in a picture of a rod: in the world frame, lengths in mm."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from rodmodel.view.rod_shape import Pose

FORCE_COLOUR, MOMENT_COLOUR, GRAVITY_COLOUR = "#c0392b", "#7d3c98", "#444444"
# Lengths of the arrows over the rod's: of tip loads, of a distributed force, and of gravity.
_LONGEST, _SHORTEST = 0.33, 0.14
_ALONG = 0.18
_GRAVITY = 0.25


class Arrow(NamedTuple):
    """Arrow of a load with its value, which stands beyond the free end. A moment's arrow has two heads."""

    tail: np.ndarray
    head: np.ndarray
    colour: str
    text: str
    heads: int = 1
    free_head: bool = False

    @property
    def free_end(self) -> np.ndarray:
        """End that does not touch the body."""
        return self.head if self.free_head else self.tail

    @property
    def outward(self) -> np.ndarray:
        """Vector from the other end to the free one."""
        return np.asarray(self.head - self.tail if self.free_head else self.tail - self.head)


def arrows_of(given: Mapping[str, Any], pose: Pose, beside: np.ndarray) -> list[Arrow]:
    """Return the arrows of the loads that are not zero.

    Parameters
    ----------
    given : loads in SI, by their names in `Rod.solve`; None for an absent load.
    pose : pose of the rod that carries them.
    beside : centre of gravity's arrow [mm].
    """
    cap = pose.frames[-1]
    turned = {"tip": np.eye(3), "follower": cap}
    forces = {kind: _load(given, f"{kind}_force", turn) for kind, turn in turned.items()}
    moments = {kind: _load(given, f"{kind}_moment", turn) for kind, turn in turned.items()}
    note = {"tip": "", "follower": ", turning with the cap"}
    largest = max(float(np.linalg.norm(force)) for force in forces.values())
    arrows = []
    for kind, force in forces.items():
        size = float(np.linalg.norm(force))
        if size > 0.0:
            length = pose.length * max(_SHORTEST, _LONGEST * size / largest)
            arrows.append(_at_tip(pose, force / size * length, FORCE_COLOUR, f"{size:.3g} N{note[kind]}", 1))
    for kind, moment in moments.items():
        size = float(np.linalg.norm(moment))
        if size > 0.0:
            text = f"{1e3 * size:.3g} N mm{note[kind]}"
            arrows.append(_at_tip(pose, moment * (_LONGEST * pose.length / size), MOMENT_COLOUR, text, 2))
    along = _load(given, "distributed_force", np.eye(3))
    size = float(np.linalg.norm(along))
    if size > 0.0:
        body = np.flatnonzero(~pose.in_cap)
        stations = body[(np.linspace(0.15, 0.95, 5) * (len(body) - 1)).astype(int)]
        for number, station in enumerate(stations):
            side = pose.radius * _across(along, pose.frames[station, :, 2])
            head = pose.centre[station] - side
            text = f"{size:.3g} N/m" if number == 2 else ""
            arrows.append(Arrow(head - along * (_ALONG * pose.length / size), head, FORCE_COLOUR, text))
    gravity = _load(given, "gravity", np.eye(3))
    size = float(np.linalg.norm(gravity))
    if size > 0.0:
        half = 0.5 * _GRAVITY * pose.length * gravity / size
        arrows.append(Arrow(beside - half, beside + half, GRAVITY_COLOUR, f"gravity {size:.3g} m/s²"))
    return arrows


def _load(given: Mapping[str, Any], name: str, turn: np.ndarray) -> np.ndarray:
    load = given.get(name)
    return np.zeros(3) if load is None else turn @ np.asarray(load, float)


def _at_tip(pose: Pose, vector: np.ndarray, colour: str, text: str, heads: int) -> Arrow:
    """Return an arrow that leaves the cap's outer face, or ends on it if the load pushes."""
    outward = pose.frames[-1, :, 2]
    tip = pose.centre[-1] + 0.08 * pose.radius * outward
    if vector @ outward >= 0.0:
        return Arrow(tip, tip + vector, colour, text, heads, free_head=True)
    return Arrow(tip - vector, tip, colour, text, heads)


def _across(vector: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the unit vector along the part of `vector` normal to the axis; zero if it has none."""
    part = vector - (vector @ axis) * axis
    size = np.linalg.norm(part)
    return np.asarray(part / size) if size > 1e-9 * np.linalg.norm(vector) else np.zeros(3)
