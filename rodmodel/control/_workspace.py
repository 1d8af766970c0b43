"""What a rod can reach: poses at pressures that fill the calibrated domain."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from rodmodel.actuator import Domain
from rodmodel.core import CoreRod

_BATCH = 1024

# Powers of the root of x⁴ = x + 1, the golden ratio's kin, step evenly through a cube (Roberts 2018, The
# unreasonable effectiveness of quasirandom sequences).
_STEPS = 1.22074408460575947536 ** -np.arange(1.0, 4.0)


class Workspace(NamedTuple):
    """Poses at pressures of the domain; arrays of one row a sample."""

    pressure: np.ndarray
    """[Pa], (n, 3)."""
    face: np.ndarray
    """Chamber 0, 1 or 2 that has no pressure on the face of the domain that the sample is of; 3 inside."""
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
    """Solve at pressures all over the domain of a rod.

    Parameters
    ----------
    rod : compiled.
    samples : about how many: a grid on each of the three faces where one chamber has no pressure, a fourth of
        them each, and the rest inside.
    loads : `tip_force`, `tip_moment`, `gravity`, or None of each.
    advance : told how many of how many samples are done, as they come.
    threads : over which the samples are spread.
    """
    domain = rod.domain
    faces = [_face(domain, chamber, samples // 4) for chamber in range(3)]
    inside = _inside(domain, samples - 3 * (samples // 4))
    pressure = np.concatenate([*faces, inside])
    face = np.repeat(np.arange(4), [*map(len, faces), len(inside)])
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
    """About as many points of a face, edges and corners included, (n, 3)."""
    pair = [chamber for chamber in range(3) if chamber != without]
    first, second = (domain.pressure_max[chamber] for chamber in pair)
    total = min(domain.pressure_sum_max, first + second)
    # Lines from the corner at rest to the far side, closer there, where a step of pressure bends more.
    rays = max(3, round(np.sqrt(count)))
    angle = np.linspace(0.0, 0.5 * np.pi, rays)
    ways = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    # The rays pass through the corners of the far side too.
    corners = np.array([(first, min(second, total - first)), (min(first, total - second), second)])
    ways = np.concatenate([ways, corners / np.linalg.norm(corners, axis=1)[:, None]])
    with np.errstate(divide="ignore"):
        reach = np.min([first / ways[:, 0], second / ways[:, 1], total / ways.sum(axis=1)], axis=0)
    fractions = np.linspace(0.0, 1.0, max(3, round(count / len(ways))))[1:]
    points = np.concatenate([np.zeros((1, 2)), *(fraction * reach[:, None] * ways for fraction in fractions)])
    return np.insert(points, without, 0.0, axis=1)


def _inside(domain: Domain, count: int) -> np.ndarray:
    """As many points inside, spread evenly, (n, 3)."""
    largest = np.array(domain.pressure_max)
    share = min(1.0, domain.pressure_sum_max / largest.sum()) ** 3
    number = np.arange(1, int(8 * count / share) + 9)[:, None]
    points = largest * np.mod(0.5 + number * _STEPS, 1.0)
    return points[points.sum(axis=1) <= domain.pressure_sum_max][:count]
