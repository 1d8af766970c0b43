"""The rod for a control loop: compiled once, NumPy in and out, warm starts."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from rodmodel._equilibria import FixedStep
from rodmodel._kernel import compile_with_kernels, one_kernel
from rodmodel._loads import Loads, resultants
from rodmodel._tip import Tip, solve_and_differentiate_tip, tip_of

_LOADS = ("tip_force", "tip_moment", "gravity", "distributed_force")


class Prediction(NamedTuple):
    """Pose in the frame of the base, as NumPy arrays; with a leading axis where the inputs had one."""

    tip_position: np.ndarray
    """Centre of the cap's outer face [m]."""
    tip_rotation: np.ndarray
    """Frame of the cap, directors as columns."""
    bending_angle: np.ndarray
    """θ [rad]."""
    bending_plane: np.ndarray
    """γ [rad]."""
    converged: np.ndarray
    stable: np.ndarray
    in_domain: np.ndarray
    """Whether the pressures are those of the calibration; moments are not looked at."""


class TipJacobian(NamedTuple):
    """Derivatives of the tip in the frame of the base, of the fixed steps themselves; (3, 3) arrays."""

    position_by_pressure: np.ndarray
    """[m/Pa]"""
    turn_by_pressure: np.ndarray
    """Small turn of the cap, δR = (turn × R) [rad/Pa]."""
    position_by_force: np.ndarray
    """[m/N]"""
    turn_by_force: np.ndarray
    """[rad/N]"""


class Predictor:
    """Compiled solve of one rod with fixed steps, without Python's and JAX's costs around it.

    Made by [`rodmodel.Rod.predictor`][]. The first call of each kind, one row or a batch of a size, compiles;
    the constructor makes those that are asked for. No later call traces again.

    Parameters
    ----------
    rod : to be solved.
    loads : which loads the calls give, of `tip_force`, `tip_moment`, `gravity`, `distributed_force`.
    solver : fixed steps; its tolerance is 1e-7 where it has none.
    batch : sizes of batches to compile at once.
    devices : over which batches are spread, each an equal part of the rows; the first alone by default.

    Attributes
    ----------
    compilations : how many functions have been compiled: for single calls, with the Jacobian, and for each
        size of a batch.
    """

    def __init__(
        self,
        rod: Any,
        loads: Sequence[str] = (),
        solver: FixedStep = FixedStep(),  # noqa: B008 (frozen)
        batch: Sequence[int] = (),
        devices: Sequence[Any] | None = None,
    ) -> None:
        unknown = [name for name in loads if name not in _LOADS]
        if unknown:
            raise ValueError(f"loads: got {unknown[0]!r}, expected any of {', '.join(_LOADS)}")
        self.rod = rod
        self.loads = tuple(loads)
        self.devices = tuple(devices or jax.devices()[:1])
        self._dtype = np.dtype(jnp.zeros(()).dtype)
        self._width = 3 * (1 + len(self.loads))

        def row_of(row: Any) -> Any:
            # Runs when JAX traces, not when it calls.
            self.compilations += 1
            return _row(rod, self.loads, solver, row)

        def row_with_jacobian(row: Any) -> Any:
            self.compilations += 1
            return _row(rod, self.loads, solver, row, jacobian=True)

        self._one = compile_with_kernels(row_of)
        self._one_with_jacobian = compile_with_kernels(row_with_jacobian)
        self._many = self._spread(jax.vmap(row_of))
        self._warm: np.ndarray | None = None
        self.compilations = 0
        self(np.zeros(3), **{name: np.zeros(3) for name in self.loads})
        self.reset()
        for size in batch:
            self(np.zeros((size, 3)), **{name: np.zeros(3) for name in self.loads})

    def jacobian(self, pressure: Any, **loads: Any) -> tuple[Prediction, TipJacobian]:
        """Predict, and differentiate the tip by pressures and tip force; single calls only.

        The first call compiles. By the implicit function theorem on the equations of the fixed steps.
        """
        row = self._given(pressure, loads)
        if any(value.ndim != 1 for value in row):
            raise ValueError(f"pressure, loads: got shapes {[v.shape for v in row]}, expected (3,) each")
        prediction, derivatives = self._single(np.concatenate(row), self._one_with_jacobian)
        position, turn = derivatives[:18].reshape(3, 6), derivatives[18:].reshape(3, 6)
        return prediction, TipJacobian(position[:, :3], turn[:, :3], position[:, 3:], turn[:, 3:])

    def _spread(self, rows: Any) -> Any:
        if len(self.devices) == 1:
            return compile_with_kernels(rows)
        mesh = Mesh(np.array(self.devices), ("rows",))
        spec = PartitionSpec("rows")
        self._sharding = NamedSharding(mesh, spec)
        spread = jax.shard_map(rows, mesh=mesh, in_specs=spec, out_specs=spec, check_vma=False)
        return compile_with_kernels(spread)

    def reset(self) -> None:
        """Forget the last solution: the next single call starts cold."""
        self._warm = None

    def __call__(self, pressure: Any, **loads: Any) -> Prediction:
        """Predict.

        A single call starts from the last one's solution; where that leads to none that is stable, and in
        batches, the start is cold.

        Parameters
        ----------
        pressure : gauge pressures [Pa], (3,) or (rows, 3).
        loads : those named at construction, (3,) or (rows, 3), in the frame of the base: force [N], moment
            [N m], acceleration [m/s²], force per length [N/m].

        Returns
        -------
        prediction : rows that cannot be solved are not converged; NaN goes in, NaN comes out.
        """
        given = self._given(pressure, loads)
        if all(value.ndim == 1 for value in given):
            return self._single(np.concatenate(given), self._one)[0]
        count = max(value.shape[0] for value in given if value.ndim == 2)
        rows = np.concatenate([np.broadcast_to(value, (count, 3)) for value in given], axis=1)
        return self._batch(rows)

    def _given(self, pressure: Any, loads: dict[str, Any]) -> list[np.ndarray]:
        if set(loads) != set(self.loads):
            raise ValueError(f"loads: got {sorted(loads)}, expected {sorted(self.loads)}")
        given = [np.asarray(pressure, self._dtype)]
        given += [np.asarray(loads[name], self._dtype) for name in self.loads]
        for name, value in zip(("pressure", *self.loads), given, strict=True):
            if value.shape[-1:] != (3,) or value.ndim > 2:
                raise ValueError(f"{name}: got shape {value.shape}, expected (3,) or (rows, 3)")
        return given

    def _single(self, row: np.ndarray, solve: Any) -> tuple[Prediction, np.ndarray]:
        warm = np.full(3, np.nan, self._dtype) if self._warm is None else self._warm
        found = np.asarray(solve(np.concatenate([row, warm])))
        prediction, unknown = _unpack(found)
        if self._warm is not None and not (prediction.converged and prediction.stable):
            self._warm = None
            return self._single(row, solve)
        self._warm = unknown if prediction.converged else None
        return prediction, found[20:]

    def _batch(self, rows: np.ndarray) -> Prediction:
        count, parts = rows.shape[0], len(self.devices)
        cold = np.full((count, 3), np.nan, self._dtype)
        padded = np.concatenate([rows, cold], axis=1)
        if parts > 1:
            # As many rows for each device: the last ones are repeated.
            padded = np.pad(padded, ((0, -count % parts), (0, 0)), mode="edge")
            padded = jax.device_put(padded, self._sharding)
        return _unpack(np.asarray(self._many(padded))[:count])[0]


def _row(rod: Any, names: tuple[str, ...], solver: FixedStep, row: Any, jacobian: bool = False) -> Any:
    """Solve one row: pressures, loads, start."""
    parts = [row[3 * k : 3 * k + 3] for k in range(len(names) + 2)]
    good = jnp.all(jnp.isfinite(row[:-3])) & jnp.all(parts[0] >= 0.0)
    pressure, *given = (jnp.where(good, part, 0.0) for part in parts[:-1])
    loads = resultants(Loads(**dict(zip(names, given, strict=True))), rod.actuator, row.dtype)

    def answer_of(pressure: Any, loads: Any, start: Any) -> tuple[Tip, tuple[Any, ...]]:
        if jacobian:
            return solve_and_differentiate_tip(rod.section, rod.actuator, loads, solver, pressure, start)
        return tip_of(rod.section.at(pressure), rod.actuator, loads, solver, pressure, start), ()

    tip, change = one_kernel(answer_of, pressure, loads, parts[-1])
    bend = jnp.stack([tip.angle, tip.plane])
    pose = jnp.concatenate([tip.position, tip.rotation.ravel(), bend, tip.unknown])
    flags = jnp.stack([tip.converged, tip.stable, rod.domain.covers_pressure(pressure)]).astype(row.dtype)
    found = [jnp.where(good, pose, jnp.nan), jnp.where(good, flags, 0.0)]
    return jnp.concatenate(found + [jnp.where(good, part.ravel(), jnp.nan) for part in change])


def _unpack(found: np.ndarray) -> tuple[Prediction, np.ndarray]:
    lead = found.shape[:-1]
    prediction = Prediction(
        found[..., 0:3],
        found[..., 3:12].reshape(*lead, 3, 3),
        found[..., 12],
        found[..., 13],
        found[..., 17] > 0.0,
        found[..., 18] > 0.0,
        found[..., 19] > 0.0,
    )
    return prediction, found[..., 14:17]
