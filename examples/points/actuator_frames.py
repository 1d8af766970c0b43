"""Finite-element frames for the animation: skin and axis of the full actuator along two paths.

Run as ``python examples/points/actuator_frames.py [DIRECTORY] [--only NAME ...]``. Every state is kept as
soon as it is found, and a stopped run goes on from there; on the coarse mesh a path takes up to an hour. The
frames that ship are examples/data/frames-chamber1.npz and frames-circle.npz.

Chamber 1 alone rises to 70 kPa, and the body keeps its plane of symmetry. On the circle the bending plane
goes once around at a bending angle of 40 degrees, under the pressures that the calibrated rod's inverse
answers with: nothing is fed back, so that the finite elements show how round the circle is.
"""

import argparse
import shutil
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jaxtyping import Float
from rich.progress import track

import rodmodel
from fem_reference import Actuator, ActuatorLoad, ActuatorRun, ActuatorState, prepare_process

DIRECTORY = Path(__file__).parents[1] / "data"
RISE_KPA = [*range(5, 71, 5)]
CIRCLE_ANGLE_DEG, CIRCLE_PLANES_DEG = 40.0, [15.0 * n for n in range(25)]
# Skin positions are kept as whole multiples of this [m], every second node along the axis.
GRAIN, ALONG = 5e-6, 2


def pressures(name: str) -> Float[np.ndarray, "n 3"]:
    """Pressures of a path's states [Pa]."""
    if name == "chamber1":
        return np.outer(1e3 * np.array(RISE_KPA), [1.0, 0.0, 0.0])
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
    """Follow a path, its states and frames kept one by one and the frames gathered at the end."""
    parts = directory / f"frames-{name}.parts"
    asked = pressures(name)[:last]
    loads = [ActuatorLoad((float(p), float(q), float(r))) for p, q, r in asked]
    actuator = Actuator(level=level, symmetric=name == "chamber1")
    skin = skin_nodes(actuator)
    description = {"path": name, "elements": str(level), "pressure_pa": asked.tolist()}
    run = ActuatorRun(parts, description)
    done = len(run.records())
    if done and not (parts / f"frame_{done - 1:04d}.npz").exists():
        # Killed between a state and its frame.
        shutil.rmtree(parts)
        run, done = ActuatorRun(parts, description), 0
    states = run.states(actuator, loads)
    # Where all are there, the last state comes once more.
    first = min(done, len(loads) - 1)
    for number in track(range(first, len(loads)), f"frames of {name}"):
        np.savez_compressed(parts / f"frame_{number:04d}.npz", **frame(next(states), skin))
    frames = [np.load(parts / f"frame_{n:04d}.npz") for n in range(len(loads))]
    gathered = {key: np.array([one[key] for one in frames]) for key in frames[0].files}
    np.savez_compressed(directory / f"frames-{name}.npz", **gathered, grain=GRAIN)
    shutil.rmtree(parts)
    print(f"{len(loads)} frames in {directory / f'frames-{name}.npz'}")


def main(arguments: list[str] | None = None) -> None:
    """Follow the paths whose frames are not there yet."""
    jax.config.update("jax_enable_x64", True)
    prepare_process()
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
