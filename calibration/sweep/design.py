"""Design of experiments: loading paths for continuation, whose states a calibration samples.

Every path starts at the unloaded section, in steps small enough for the cell solver. Pressures only rise
along it: beyond buckling of the partition walls the cell has several branches, and the law is for loading.
Paths and their roles (``train`` or ``held-out``) are drawn from a seed before anything is computed; held-out
paths have their own random stream, so that more training paths do not change them. Kinds are interleaved:
any leading part of a design is a balanced, smaller design.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fem_reference import Load
from rodmodel import Domain

_PLASTIC = 1.324717957244746  # root of x³ = x + 1
_GOLDEN = 0.618033988749895
_OVER = 1.1  # stretch of a range about its middle before clipping, so that some values lie at its ends
ROUNDS = 2  # rounds of the named directions, if every path has its own winding
# Stretch of the triangle of pressure shares about its centre; points outside are moved to an edge.
_STRETCH = 1.2
# Paths around a chamber end at most this share below its largest pressure.
_LEAST_OF_CHAMBER = 0.2

Role = Literal["train", "held-out"]
Vector = NDArray[np.float64]

# Step of the named directions (one chamber, two, or all alike) relative to the largest step: actuators run
# mostly under these loads, and near their ends angles grow fastest.
_NAMED_STEP = 0.5
HELD_OUT_EVERY = 5  # every fifth path is held out
MOMENT_STEPS = 2  # least number of load steps to the largest moment


def edge(domain: Domain, direction: Vector) -> Vector:
    """Return the pressures at which rays along directions (…, 3) leave the domain [Pa].

    What a chamber may have alone (`single_max`) does not count.
    """
    uses = domain.utilisation(np.moveaxis(direction, -1, 0))
    return direction / np.asarray(uses)[..., None]


def inside(domain: Domain, pressure: Vector, moment: Vector) -> NDArray[np.bool_]:
    """Return whether loads (n, 3) [Pa], (n, 3) [N m] lie in the domain or on its edge, shape (n,)."""
    return np.asarray(domain.covers_pressure(pressure.T) & domain.covers_moment(moment.T))


@dataclass(frozen=True)
class LoadingPath:
    """Named sequence of loads with its role, and its own ψ [rad] if orientations vary."""

    name: str
    role: Role
    loads: tuple[Load, ...]
    psi: float | None = None


def design_paths(
    domain: Domain,
    number: int,
    seed: int,
    pressure_step: float,
    mirror: bool = True,
    orientations: tuple[float, float] | None = None,
) -> tuple[LoadingPath, ...]:
    """Draw the loading paths of a calibration.

    Parameters
    ----------
    domain : domain of the loads.
    number : number of paths, training and held-out together.
    seed : seed of the random streams.
    pressure_step : largest change of a pressure between loads [Pa]; half of it on paths with one chamber,
        two, or all alike.
    mirror : whether the section is symmetric in the plane of chamber 1, so that chamber 3 alone can be
        left out.
    orientations : range of ψ [rad] from which each path draws its own; None for a single orientation.

    Returns
    -------
    paths in the order in which to run them.
    """
    if number < 1:
        raise ValueError(f"number: got {number} paths, expected at least 1")
    if not pressure_step > 0:
        raise ValueError(f"pressure_step: got {pressure_step} Pa, expected a positive step")
    train_stream, held_out_stream = np.random.SeedSequence(seed).spawn(2)
    rounds = 1 if orientations is None else ROUNDS
    train = _train_waypoints(domain, np.random.default_rng(train_stream), mirror, rounds)
    held_out = _held_out_waypoints(domain, np.random.default_rng(held_out_stream))
    psi = {"train": _evenly(), "held-out": _uniformly(np.random.default_rng([seed, 1]))}
    paths = []
    for index in range(number):
        role: Role = "held-out" if index % HELD_OUT_EVERY == HELD_OUT_EVERY - 1 else "train"
        kind, waypoints = next(held_out if role == "held-out" else train)
        step = _NAMED_STEP * pressure_step if kind == "named" else pressure_step
        loads = _from_rest(domain, waypoints, step)
        own = None
        if orientations is not None:
            own = orientations[0] + (orientations[1] - orientations[0]) * next(psi[role])
        paths.append(LoadingPath(f"{index:03d}-{role}-{kind}", role, loads, own))
    return tuple(paths)


def paths_around(
    domain: Domain, chamber: int, number: int, seed: int, pressure_step: float
) -> tuple[LoadingPath, ...]:
    """Draw loading paths in the neighbourhood of one chamber alone.

    The first goes along it. The others end near its largest pressure, with random ones in the two others;
    every second of them has moments on the way, and every fifth is held out.

    Parameters
    ----------
    domain : domain of the loads; the largest pressures of the two others bound the neighbourhood.
    chamber : number of the chamber, from 1.
    number, seed, pressure_step : see `design_paths`; half of the step on the path along the chamber.
    """
    rng = np.random.default_rng([seed, 2, chamber])
    own, none = np.eye(3)[chamber - 1], np.zeros(3)
    paths = []
    for index in range(number):
        role: Role = "held-out" if index % HELD_OUT_EVERY == HELD_OUT_EVERY - 1 else "train"
        share = np.where(own > 0.0, 1.0 - _LEAST_OF_CHAMBER * rng.random(), rng.random(3))
        limit = edge(domain, own if index == 0 else share * np.asarray(domain.pressure_max))
        if index == 0:
            kind, step, waypoints = "named", _NAMED_STEP, [(limit, none)]
        elif index % 2:
            kind, step, waypoints = "free", 1.0, [(limit, none)]
        else:
            kind, step, waypoints = "mixed", 1.0, _mixture(domain, rng, limit)
        loads = _from_rest(domain, waypoints, step * pressure_step)
        paths.append(LoadingPath(f"{index:03d}-{role}-{kind}", role, loads))
    return tuple(paths)


Waypoints = tuple[str, list[tuple[Vector, Vector]]]  # kind, (pressure [Pa], moment [N m]) at each


def _evenly() -> Iterator[float]:
    """Yield a low-discrepancy sequence on [0, 1] by the golden ratio; a tenth of it lies at the ends."""
    place = 0.0
    while True:
        yield float(np.clip(_OVER * (place - 0.5) + 0.5, 0.0, 1.0))
        place = (place + _GOLDEN) % 1.0


def _uniformly(rng: np.random.Generator) -> Iterator[float]:
    while True:
        yield float(rng.random())


def _train_waypoints(
    domain: Domain, rng: np.random.Generator, mirror: bool, rounds: int
) -> Iterator[Waypoints]:
    """Yield training paths without end: first the named directions, then a spread over all directions."""
    none = np.zeros(3)
    singles = [np.eye(3)[k] for k in ((0, 1) if mirror else (0, 1, 2))]
    pairs = [
        np.array(d, dtype=float)
        for d in ([(1, 1, 0), (0, 1, 1)] if mirror else [(1, 1, 0), (0, 1, 1), (1, 0, 1)])
    ]
    named = (*singles, *pairs, np.ones(3))
    for number, direction in enumerate(named * rounds):
        limit = edge(domain, direction)
        # The first states lie where the section is most compliant.
        yield "named", [(0.03 * limit, none), (limit, none)]
        # Paths of moment alone take the longest and add the least: one round of them is enough.
        if number % 2 == 0 and number < len(named):
            yield "moment", [(none, _sphere(rng, domain)) for _ in range(3)]
    for kind, direction in zip(cycle(("mixed", "free", "mixed")), _directions(rng)):
        limit = edge(domain, direction)
        yield kind, [(limit, none)] if kind == "free" else _mixture(domain, rng, limit)


def _held_out_waypoints(domain: Domain, rng: np.random.Generator) -> Iterator[Waypoints]:
    """Yield held-out paths without end: uniform pressures, alternately without and with moment."""
    for with_moment in cycle((False, True)):
        pressure = _uniform_pressure(domain, rng)
        if with_moment:
            yield "mixed", _mixture(domain, rng, pressure)
        else:
            yield "free", [(pressure, np.zeros(3))]


def _mixture(domain: Domain, rng: np.random.Generator, pressure: Vector) -> list[tuple[Vector, Vector]]:
    """Return waypoints that ramp the pressure while the moment passes through random values."""
    moments = [_ball(rng, domain) for _ in range(3)]
    return [(share * pressure, moment) for share, moment in zip((0.3, 0.65, 1.0), moments, strict=True)]


def _directions(rng: np.random.Generator) -> Iterator[Vector]:
    """Yield a low-discrepancy sequence of non-negative pressure directions; some have an empty chamber.

    It is the additive sequence of the plastic number (Roberts 2018, The unreasonable effectiveness of
    quasirandom sequences), mapped from the square to the triangle of pressure shares.
    """
    point, step = rng.random(2), np.array([1.0 / _PLASTIC, 1.0 / _PLASTIC**2])
    while True:
        root = np.sqrt(point[0])
        shares = np.array([1.0 - root, root * (1.0 - point[1]), root * point[1]])
        shares = np.maximum(_STRETCH * (shares - 1.0 / 3.0) + 1.0 / 3.0, 0.0)
        yield shares / shares.sum()
        point = (point + step) % 1.0


def _uniform_pressure(domain: Domain, rng: np.random.Generator) -> Vector:
    while True:
        pressure = rng.random(3) * np.asarray(domain.pressure_max)
        if domain.covers_pressure(pressure):
            return pressure


def _sphere(rng: np.random.Generator, domain: Domain) -> Vector:
    """Return a random moment on the edge of the domain's ellipsoid."""
    vector = rng.standard_normal(3)
    return np.asarray(domain.moment_axes) * vector / np.linalg.norm(vector)


def _ball(rng: np.random.Generator, domain: Domain) -> Vector:
    """Return a uniform random moment inside the domain's ellipsoid."""
    return rng.random() ** (1 / 3) * _sphere(rng, domain)


def _from_rest(
    domain: Domain, waypoints: Sequence[tuple[Vector, Vector]], pressure_step: float
) -> tuple[Load, ...]:
    """Return loads in even steps from the unloaded section straight through the waypoints."""
    none = (0.0, 0.0, 0.0)
    goals = [Load(tuple(pressure.tolist()), tuple(moment.tolist())) for pressure, moment in waypoints]
    return walk(Load(none, none), goals, pressure_step, domain.moment_axes)


def walk(
    start: Load, goals: Sequence[Load], pressure_step: float, moment_axes: tuple[float, float, float]
) -> tuple[Load, ...]:
    """Return loads in even steps from one load straight through others, all without imposed curvature.

    Parameters
    ----------
    start, goals : the load to begin at, which is left out, and those to pass.
    pressure_step : largest change of a pressure between loads [Pa].
    moment_axes : half axes of the ellipsoid of moments [N m], which takes `MOMENT_STEPS` loads to cross.
    """
    loads: list[Load] = []
    moment_step = np.asarray(moment_axes) / MOMENT_STEPS
    for goal in goals:
        pressure_change = np.abs(np.subtract(goal.pressure, start.pressure)).max() / pressure_step
        moment_change = np.subtract(goal.moment or 0.0, start.moment or 0.0) / moment_step
        steps = int(np.ceil(max(pressure_change, float(np.linalg.norm(moment_change))) - 1e-9))
        loads += [between(start, goal, number / steps) for number in range(1, steps + 1)]
        start = goal
    return tuple(loads)


def between(start: Load, goal: Load, share: float) -> Load:
    """Interpolate between two loads without imposed curvature."""

    def mix(a: Sequence[float], b: Sequence[float]) -> tuple[float, float, float]:
        first, second, third = (np.asarray(a) + share * (np.asarray(b) - np.asarray(a))).tolist()
        return first, second, third

    none = (0.0, 0.0, 0.0)
    return Load(mix(start.pressure, goal.pressure), mix(start.moment or none, goal.moment or none))
