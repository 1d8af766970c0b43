"""A state of the actuator as plain numbers, in the units that people read, and the load that it is under."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fem_reference.actuator import ActuatorState
from fem_reference.actuator_load import ActuatorLoad

_MM, _KPA = 1e3, 1e-3


def state_record(state: ActuatorState) -> dict[str, Any]:
    """One JSON object: angles in degrees, lengths in mm, pressures in kPa, forces in N, moments in N mm."""
    shape = state.shape
    limit = state.settled.limit_pressure
    distance = state.wall_distance
    return {
        **load_record(state.load),
        "bending_angle_deg": math.degrees(state.bending_angle),
        "bending_plane_deg": math.degrees(state.bending_plane),
        "tip_position_mm": (_MM * state.tip_position).tolist(),
        "tip_rotation": state.tip_rotation.tolist(),
        "chamber_volume_mm3": (1e9 * state.chamber_volume).tolist(),
        "base_force_n": state.settled.base_force.tolist(),
        "base_moment_nmm": (_MM * state.settled.base_moment).tolist(),
        "strain_energy_mj": 1e3 * state.strain_energy,
        "rod_pressure_kpa": _KPA * state.rod_pressure,
        "thread_tension_n": state.thread_tension,
        "wall_distance_mm": _MM * distance if math.isfinite(distance) else None,
        "axis": {
            "arc_length_mm": (_MM * shape.arc_length).tolist(),
            "position_mm": np.round(_MM * shape.positions, 6).tolist(),
            "curvature_per_m": np.round(shape.curvature, 6).tolist(),
            "turn_rad": np.round(Rotation.from_matrix(shape.rotations).as_rotvec(), 9).tolist(),
            "shear_mrad": np.round(1e3 * shape.shear, 6).tolist(),
        },
        "iterations": state.settled.iterations,
        "residual_n": state.settled.residual,
        "stable": state.settled.stable,
        "jumped": state.settled.jumped,
        "limit_pressure_kpa": None if limit is None else (_KPA * limit).tolist(),
        "converged": True,
    }


def load_record(load: ActuatorLoad) -> dict[str, Any]:
    """The load's part of the record."""
    return {
        "pressure_kpa": [_KPA * p for p in load.pressure],
        "tip_force_n": list(load.tip_force),
        "tip_moment_nmm": [_MM * m for m in load.tip_moment],
        "gravity_m_per_s2": list(load.gravity),
        "follower": load.follower,
    }


def load_from_record(record: Mapping[str, Any]) -> ActuatorLoad:
    """The load that `load_record` wrote."""

    def triple(key: str, unit: float = 1.0) -> tuple[float, float, float]:
        first, second, third = (float(value) / unit for value in record[key])
        return first, second, third

    return ActuatorLoad(
        triple("pressure_kpa", _KPA),
        triple("tip_force_n"),
        triple("tip_moment_nmm", _MM),
        triple("gravity_m_per_s2"),
        bool(record["follower"]),
    )
