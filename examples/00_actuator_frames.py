"""Finite-element frames for the animation: skin and axis of the full actuator along two paths.

Run as ``python examples/00_actuator_frames.py [DIRECTORY] [--only NAME ...]``. Every state is kept as soon as
it is found, and a stopped run goes on from there; on the coarse mesh a path takes up to an hour. The
frames that ship are examples/data/frames-chamber1.npz and frames-circle.npz.

Chamber 1 alone rises to 65 kPa. On the circle the bending plane goes once around at a bending angle of 40
degrees, under the pressures that the calibrated rod's inverse answers with: nothing is fed back, so that the
finite elements show how round the circle is.
"""

import argparse
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jaxtyping import Float
from rich.progress import track

import rodmodel
from fem_reference import Actuator, ActuatorLoad, ActuatorState

DIRECTORY = Path(__file__).parent / "data"
RISE_KPA = [5.0 * n for n in range(1, 14)]
CIRCLE_ANGLE_DEG, CIRCLE_PLANES_DEG = 40.0, [15.0 * n for n in range(25)]
# Skin positions are kept as whole multiples of this [m], every second node along the axis.
GRAIN, ALONG = 5e-6, 2


def pressures(name: str) -> Float[np.ndarray, "n 3"]:
    """Pressures of a path's states [Pa]."""
    if name == "chamber1":
        return 1e3 * np.outer(RISE_KPA, [1.0, 0.0, 0.0])
    rod = rodmodel.load("double-helix")
    answers = [
        rod.inverse(bending_angle=np.deg2rad(CIRCLE_ANGLE_DEG), bending_plane=np.deg2rad(plane))
        for plane in CIRCLE_PLANES_DEG
    ]
    return np.array([answer.pressure for answer in answers])


def skin_nodes(actuator: Actuator) -> np.ndarray:
    """Nodes of the outer skin on a grid: places along the axis by places around it."""
    rest = actuator.equations.rest_positions[: actuator.equations.nodes]
    radius = 5e2 * actuator.model.geometry.body_diameter
    skin = np.flatnonzero(np.abs(np.hypot(rest[:, 0], rest[:, 1]) - radius) < 1e-6 * radius)
    height = np.round(rest[skin, 2], 6)
    around = np.arctan2(rest[skin, 1], rest[skin, 0])
    ordered = skin[np.lexsort((around, height))]
    grid = ordered.reshape(len(np.unique(height)), -1)
    return np.concatenate([grid[:-1:ALONG], grid[-1:]])


def frame(state: ActuatorState, skin: np.ndarray) -> dict[str, Any]:
    """What the animation shows of a state; SI units."""
    return {
        "pressure": np.array(state.load.pressure),
        "skin": np.round(1e-3 * state.deformation.positions[skin] / GRAIN).astype(np.int16),
        "axis": state.shape.positions.astype(np.float32),
        "tip": state.tip_position,
        "angle": state.bending_angle,
        "plane": state.bending_plane,
        "jumped": state.settled.jumped,
    }


def follow(name: str, directory: Path, level: str, last: int | None) -> None:
    """Follow a path, its frames kept one by one and gathered at the end."""
    parts = directory / f"frames-{name}.parts"
    parts.mkdir(parents=True, exist_ok=True)
    loads = [ActuatorLoad((float(p), float(q), float(r))) for p, q, r in pressures(name)][:last]
    actuator = Actuator(level=level)
    skin = skin_nodes(actuator)
    done = sum((parts / f"{n:03d}.npz").exists() for n in range(len(loads)))
    # On the circle no wall snaps: from rest straight to the next state. Chamber 1 goes its way again.
    first = done if name == "circle" or done == len(loads) else 0
    states = actuator.follow(loads[first:])
    for number in track(range(first, len(loads)), f"frames of {name}"):
        state = next(states)
        if number >= done:
            np.savez_compressed(parts / f"{number:03d}.npz", **frame(state, skin))
    frames = [np.load(parts / f"{n:03d}.npz") for n in range(len(loads))]
    gathered = {key: np.array([one[key] for one in frames]) for key in frames[0].files}
    np.savez_compressed(directory / f"frames-{name}.npz", **gathered, grain=GRAIN)
    for part in parts.iterdir():
        part.unlink()
    parts.rmdir()
    print(f"{len(loads)} frames in {directory / f'frames-{name}.npz'}")


def main(arguments: list[str] | None = None) -> None:
    """Follow the paths whose frames are not there yet."""
    jax.config.update("jax_enable_x64", True)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", nargs="?", type=Path, default=DIRECTORY)
    parser.add_argument("--only", nargs="+", metavar="NAME", default=["chamber1", "circle"])
    parser.add_argument("--elements", default="coarse", help="mesh level (default: %(default)s)")
    parser.add_argument("--last", type=int, default=None, help="states to follow (default: all)")
    options = parser.parse_args(arguments)
    for name in options.only:
        if not (options.directory / f"frames-{name}.npz").exists():
            follow(name, options.directory, options.elements, options.last)


if __name__ == "__main__":
    main()
