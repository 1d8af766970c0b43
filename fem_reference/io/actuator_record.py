"""JSON record of an actuator state and its load, in degrees, mm, kPa, N and N mm."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fem_reference.actuator import ActuatorLoad, ActuatorState
from fem_reference.io.records import FLAG, Kind, Numbers, Object, OneOf

_MM, _KPA = 1e3, 1e-3

_FORCE, _MOMENT = 1e6, 1e9
#: Schema of a record. Records of earlier versions lack ``turn_rad`` and ``shear_mrad``.
RECORD_KEYS: Mapping[str, Kind] = {
    "pressure_kpa": Numbers(0.0, 1e5, "kPa", (3,)),
    "tip_force_n": Numbers(-_FORCE, _FORCE, "N", (3,)),
    "tip_moment_nmm": Numbers(-_MOMENT, _MOMENT, "N mm", (3,)),
    "gravity_m_per_s2": Numbers(-1e5, 1e5, "m/s²", (3,)),
    "follower": FLAG,
    "bending_angle_deg": Numbers(0.0, 1e5, "deg"),
    "bending_plane_deg": Numbers(-360.0, 360.0, "deg"),
    "tip_position_mm": Numbers(-1e5, 1e5, "mm", (3,)),
    "tip_rotation": Numbers(-1.001, 1.001, "", (3, 3)),
    "chamber_volume_mm3": Numbers(0.0, 1e12, "mm³", (3,)),
    "base_force_n": Numbers(-_FORCE, _FORCE, "N", (3,)),
    "base_moment_nmm": Numbers(-_MOMENT, _MOMENT, "N mm", (3,)),
    "residual_n": Numbers(0.0, _FORCE, "N"),
    "iterations": Numbers(0, 1e9, whole=True),
    "stable": OneOf((False, True), null=True),
    "jumped": FLAG,
    "axis": Object(
        {
            "arc_length_mm": Numbers(0.0, 1e5, "mm", (None,)),
            "position_mm": Numbers(-1e5, 1e5, "mm", (None, 3)),
            "curvature_per_m": Numbers(-1e6, 1e6, "1/m", (None, 3)),
            "turn_rad": Numbers(-7.0, 7.0, "rad", (None, 3), optional=True),
            "shear_mrad": Numbers(-1e4, 1e4, "mrad", (None, 2), optional=True),
        }
    ),
}


def state_record(state: ActuatorState) -> dict[str, Any]:
    """Return the record of a state, as one JSON object."""
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
    """Return the load's part of the record."""
    return {
        "pressure_kpa": [_KPA * p for p in load.pressure],
        "tip_force_n": list(load.tip_force),
        "tip_moment_nmm": [_MM * m for m in load.tip_moment],
        "gravity_m_per_s2": list(load.gravity),
        "follower": load.follower,
    }
