"""Workspace of a rod: poses at pressures that fill the calibrated domain."""

import math
from collections.abc import Callable, Mapping
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from rodmodel.actuator import Domain
from rodmodel.core import CoreRod

# Samples solved between two reports of progress.
_BATCH = 1024

# Determinant of normals that count as parallel, and slack of a corner in its other limits: rounding.
_PARALLEL = 1e-9

# Samples of a chamber alone beyond the pressures that it has beside others.
_ALONE = 25

# Steps of an additive quasirandom sequence in three dimensions: powers of the root of x⁴ = x + 1 (Roberts
# 2018, The unreasonable effectiveness of quasirandom sequences).
_STEPS = 1.22074408460575947536 ** -np.arange(1.0, 4.0)


class Workspace(NamedTuple):
    """Poses at pressures of the domain; arrays with one row per sample."""

    pressure: np.ndarray
    """[Pa], (n, 3)."""
    face: np.ndarray
    """Face of the domain that the sample lies on: the chamber 0, 1 or 2 without pressure; 3 inside; 4 beyond,
    where a chamber alone goes further."""
    tip_position: np.ndarray
    """[m], (n, 3); NaN where the rod has no equilibrium."""
    bending_angle: np.ndarray
    """θ [rad]."""
    bending_plane: np.ndarray
    """γ [rad]."""
    converged: np.ndarray
    in_domain: np.ndarray


def workspace(
    rod: CoreRod,
    samples: int,
    loads: Mapping[str, Any],
    advance: Callable[[int, int], None],
    threads: int = 1,
) -> Workspace:
    """Solve a rod at pressures that fill its domain.

    Parameters
    ----------
    rod : compiled rod.
    samples : approximate number: a quarter on a grid over each of the three faces where one chamber has no
        pressure, the rest inside. Where a chamber alone goes further, the line of its pressure is added.
    loads : `tip_force`, `tip_moment`, `gravity`, each a vector or None.
    advance : called with the number of samples done and the number of all, after every batch.
    threads : number of threads that share the samples.
    """
    domain = rod.domain
    if any(domain.pressure_min):
        raise ValueError("rod: got one of a snapped branch, expected the loading branch's")
    if samples < 1:
        raise ValueError(f"samples: got {samples}, expected 1 or more")
    faces = [_face(domain, chamber, samples // 4) for chamber in range(3)]
    inside = _inside(domain, samples - 3 * (samples // 4))
    alone = _alone(domain)
    pressure = np.concatenate([*faces, inside, alone])
    face = np.repeat(np.arange(5), [*map(len, faces), len(inside), len(alone)])
    parts = []
    for first in range(0, len(pressure), _BATCH):
        parts.append(rod.solve_many(pressure=pressure[first : first + _BATCH], threads=threads, **loads))
        advance(min(first + _BATCH, len(pressure)), len(pressure))
    found = np.concatenate(parts)
    converged = found["result"] == 0
    return Workspace(
        pressure,
        face,
        np.where(converged[:, None], found["tip_position"], np.nan),
        np.where(converged, found["bending_angle"], np.nan),
        np.where(converged, found["bending_plane"], np.nan),
        converged,
        found["in_domain"] != 0,
    )


def _face(domain: Domain, without: int, count: int) -> np.ndarray:
    """Return about `count` points of the face without one chamber, edges and corners included, (n, 3)."""
    normals, bounds = _limits(domain)
    normals = np.delete(normals, without, axis=1)
    # Rays from the corner without pressure to the far side, through its corners too.
    rays = max(3, round(np.sqrt(count)))
    angle = np.linspace(0.0, 0.5 * np.pi, rays)
    directions = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    corners = _corners(normals, bounds)
    directions = np.concatenate([directions, corners / np.linalg.norm(corners, axis=1)[:, None]])
    far = directions / (directions @ normals.T / bounds).max(axis=1)[:, None]
    fractions = np.linspace(0.0, 1.0, max(3, round(count / len(directions))))[1:]
    points = np.concatenate([np.zeros((1, 2)), *(fraction * far for fraction in fractions)])
    return np.insert(points, without, 0.0, axis=1)


def _inside(domain: Domain, count: int) -> np.ndarray:
    """Return `count` points inside the domain, spread evenly, (n, 3)."""
    normals, bounds = _limits(domain)
    largest = np.array(domain.pressure_max)
    # The box of the largest pressures, made so small that it is inside, is the least that the domain holds.
    share = float((bounds / (normals @ largest)).min()) ** 3
    number = np.arange(1, int(8 * count / share) + 9)[:, None]
    points = largest * np.mod(0.5 + number * _STEPS, 1.0)
    return points[np.all(points @ normals.T <= bounds, axis=1)][:count]


def _alone(domain: Domain) -> np.ndarray:
    """Return pressures of each chamber alone from the limits beside others to its own, (n, 3)."""
    normals, bounds = _limits(domain)
    lines = [np.empty((0, 3))]
    for way in np.eye(3):
        used = normals @ way > 0.0
        beside_others, alone = (bounds[used] / (normals @ way)[used]).min(), domain.reach(way)
        if alone > beside_others:
            lines.append(np.linspace(beside_others, alone, _ALONE)[:, None] * way)
    return np.concatenate(lines)


def _limits(domain: Domain) -> tuple[np.ndarray, np.ndarray]:
    """Return the upper limits beside others, normals · pressure ≤ bounds, (n, 3) and (n,) [Pa]."""
    normals = [np.eye(3), np.ones((1, 3))]
    bounds = [*domain.pressure_max, domain.pressure_sum_max]
    if domain.beside_max < math.inf:
        normals.append(domain.beside_share + (1.0 - domain.beside_share) * np.eye(3))
        bounds += [domain.beside_max] * 3
    return np.concatenate(normals), np.array(bounds)


def _corners(normals: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Return the points of a plane domain where two upper limits meet, (n, 2)."""
    found = []
    for pair in combinations(range(len(bounds)), 2):
        both = normals[list(pair)]
        if abs(np.linalg.det(both)) > _PARALLEL:
            point = np.linalg.solve(both, bounds[list(pair)])
            if np.all(point >= 0.0) and np.all(normals @ point <= bounds * (1.0 + _PARALLEL)):
                found.append(point)
    return np.array(found).reshape(-1, 2)
