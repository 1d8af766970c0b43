"""The calibration file: what crosses from the FEM to the rod, as one JSON object.

    {"schema": "rodmodel-calibration", "version": 1,
     "layout": {"name", "psi_rad" (null where the law is one of all orientations), "pitch_m"},
     "actuator": {"body_length_m", "cap_length_m", "body_diameter_m",
                  "mass_per_length_kg_per_m", "cap_mass_kg", and, where known, "stiff_tip_m",
                  "base_turn_rad_per_pa", "base_lag_m", "base_stiffness_n_m2", "tip_offset_m",
                  "tip_offset_curvature_per_m", "held_length_m", "shear_compliance_per_n"},
     "section_law": {"kind", "pressure_scale_pa", "curvature_scale_per_m", "energy_scale_n", "rest_volume_m2",
                     and the law's own arrays},
     "domain": {"pressure_max_pa" (three), "pressure_sum_max_pa", "moment_max_nm",
                "torque_max_nm" (null where it is the same)},
     "error": {"free_bending_angle_rad": {"median", "p95", "worst"},
               and, where known, "actuator_angle_rad": {"p90"}, ...},
     "provenance": {...}}

The law's kind is "ridge-network", with "ridge_slope", "symmetry" and, by name, the arrays of `RidgeNetwork`;
or "oriented-ridge-network", the same with "orientation_weights" of `OrientedNetwork`; or
"free-state-expansion", with "pressure_warp_pa" (number or null), "mirror", "weights" (one matrix a layer) and
"biases" (one vector a layer). `error` may hold further quantities and `provenance` is free; both come
back as they were written.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from rodmodel._record import CalibrationFileError, Record
from rodmodel.section import FreeStateExpansion, OrientedNetwork, RidgeNetwork

SCHEMA = "rodmodel-calibration"
VERSION = 1
RIDGES, ORIENTED, EXPANSION = "ridge-network", "oriented-ridge-network", "free-state-expansion"
RIDGE_SLOPE = "(1 + z^2)^-2"
_ARRAYS = {
    "feature_weights": 2,
    "feature_biases": 1,
    "directions": 2,
    "mixing": 2,
    "offsets": 1,
    "weights": 1,
    "factor": 1,
    "slopes": 1,
    "guess": 2,
}
_ENDS = {
    "stiff_tip": "stiff_tip_m",
    "base_turn": "base_turn_rad_per_pa",
    "base_lag": "base_lag_m",
    "base_stiffness": "base_stiffness_n_m2",
    "tip_offset": "tip_offset_m",
    "tip_offset_curvature": "tip_offset_curvature_per_m",
    "held_length": "held_length_m",
    "shear_compliance": "shear_compliance_per_n",
}

_SLACK = 1.0 + 1e-6
_SAME = 1e-9  # but for the rounding of a change of units [rad]

#: Of one rod; an array where rods are stacked or differentiated by it.
Number = float | Float[Array, ""]
FileLaw = FreeStateExpansion | OrientedNetwork | RidgeNetwork


@dataclass(frozen=True)
class Layout:
    """Winding layout: its name, orientation ψ [rad], None for a law of all, and pitch [m]."""

    name: str
    psi: float | None
    pitch: float

    @property
    def symmetry(self) -> float:
        """Step of ψ between sections that differ only in how their chambers are numbered [rad].

        A turn by 120° renumbers the chambers. The double helix crosses itself every 180°, half a pitch apart,
        so that a shift by half a pitch makes ψ + 180° of ψ: together, steps of 60°. Six helices are the same
        at ψ + 60° but for a shift by a sixth of a pitch.
        """
        return math.pi / 3.0 if self.name in ("double-helix", "six-helix") else 2.0 * math.pi / 3.0

    @property
    def mirrored_psi(self) -> float | None:
        """ψ of the mirror image y → −y, from 0 to `symmetry` [rad]; None where it is the section itself."""
        if self.psi is None or abs(math.remainder(2.0 * self.psi, self.symmetry)) < _SAME:
            return None
        return -self.psi % self.symmetry


@final
class Actuator(eqx.Module):
    """Lengths [m], body diameter [m], mass of the body per length [kg/m] and mass of the cap [kg].

    Near base and cap, where the section cannot widen freely, the body bends less. The `stiff_tip` [m] before
    the cap does not bend at all. The base turns by `base_turn` [rad/Pa] with the pressures, less by the free
    turn of a length `base_lag` [m], both for a section of the bending stiffness `base_stiffness` [N m²] and
    more for a softer one (zero: the same for all). The cap lies beside the arc by up to `tip_offset` [m], by
    71 % of that at the `tip_offset_curvature` [1/m]: see `rodmodel._ends`. Over the `held_length` [m] of
    both ends the chambers keep their volume. Under a force, sections lean against the axis by the
    `shear_compliance` [1/N] times its part across them; zero for a rod that does not shear.
    """

    body_length: Number
    cap_length: Number
    body_diameter: Number
    mass_per_length: Number
    cap_mass: Number
    stiff_tip: Number = 0.0
    base_turn: Number = 0.0
    base_lag: Number = 0.0
    base_stiffness: Number = 0.0
    tip_offset: Number = 0.0
    tip_offset_curvature: Number = 1.0
    held_length: Number = 0.0
    shear_compliance: Number = 0.0

    @property
    def bending_length(self) -> Number:
        """Length of the body up to its stiff end [m]."""
        return self.body_length - self.stiff_tip

    @property
    def tip_length(self) -> Number:
        """From where the body ends to bend to the cap's outer face [m]."""
        return self.cap_length + self.stiff_tip


@final
class Domain(eqx.Module):
    """Loads inside which the law was calibrated.

    Each chamber's pressure [Pa], the sum of the three [Pa], and the moment on a section: an ellipsoid with
    the largest bending moment and the largest torque [N m] as half axes, or a ball where no torque is given.
    """

    pressure_max: tuple[Number, Number, Number]
    pressure_sum_max: Number
    moment_max: Number
    torque_max: Number | None = None

    @property
    def moment_axes(self) -> tuple[Number, Number, Number]:
        """Half axes of the ellipsoid of moments, body frame [N m]."""
        torque = self.moment_max if self.torque_max is None else self.torque_max
        return self.moment_max, self.moment_max, torque

    def covers_pressure(self, pressure: Sequence[float] | np.ndarray | Array) -> Bool[ArrayLike, ""]:
        """Whether three pressures [Pa] are inside, the rounding of a change of units left aside."""
        first, second, third = pressure
        below = [p <= _SLACK * maximum for p, maximum in zip(pressure, self.pressure_max, strict=True)]
        return below[0] & below[1] & below[2] & (first + second + third <= _SLACK * self.pressure_sum_max)

    def covers_moment(self, moment: Float[Array, "3"]) -> Bool[Array, ""]:
        """Whether a moment [N m] is inside."""
        return jnp.sum((moment / jnp.asarray(self.moment_axes)) ** 2) <= _SLACK**2


@dataclass(frozen=True)
class Calibration:
    """All that a calibration file holds."""

    layout: Layout
    actuator: Actuator
    section_law: FileLaw
    domain: Domain
    error: Mapping[str, Any]
    provenance: Mapping[str, Any]

    @property
    def angle_error(self) -> float:
        """Within which the finite elements' bending angle is in 90 % of states [rad].

        Of the cell, on states held out of the fit; and where the file knows of the full actuator, of that,
        whose runs left out of the fit of the ends add their own error in squares.
        """
        cell = self.error["free_bending_angle_rad"]
        bound = float(cell.get("p90", cell["p95"]))
        actuator = self.error.get("actuator_angle_rad")
        return bound if actuator is None else math.hypot(bound, float(actuator["p90"]))


def read_calibration(path: str | Path) -> Calibration:
    """Read and validate a calibration file.

    Raises
    ------
    CalibrationFileError
        A `ValueError` of one line that names the file, the key, what came and what is expected.
    """
    record = Record.from_file(Path(path))
    record.take("schema", f'"{SCHEMA}"', lambda value: value == SCHEMA)
    record.take("version", f"version {VERSION}", lambda value: value == VERSION)
    layout = record.record("layout")
    actuator = record.record("actuator")
    domain = record.record("domain")
    error = record.record("error")
    angle = error.record("free_bending_angle_rad")
    for figure in ("median", "p95", "worst"):
        angle.not_negative(figure)
    if "actuator_angle_rad" in error.content:
        error.record("actuator_angle_rad").not_negative("p90")
    return Calibration(
        layout=Layout(
            layout.text("name"),
            None if layout.content.get("psi_rad", 0.0) is None else layout.number("psi_rad"),
            layout.positive("pitch_m"),
        ),
        actuator=Actuator(
            body_length=actuator.positive("body_length_m"),
            cap_length=actuator.not_negative("cap_length_m"),
            body_diameter=actuator.positive("body_diameter_m"),
            mass_per_length=actuator.not_negative("mass_per_length_kg_per_m"),
            cap_mass=actuator.not_negative("cap_mass_kg"),
            **{name: _told(actuator, key) for name, key in _ENDS.items() if key in actuator.content},
        ),
        section_law=_read_law(record.record("section_law")),
        domain=Domain(
            pressure_max=domain.three_positive("pressure_max_pa"),
            pressure_sum_max=domain.positive("pressure_sum_max_pa"),
            moment_max=domain.positive("moment_max_nm"),
            torque_max=domain.positive_or_none("torque_max_nm"),
        ),
        error=error.content,
        provenance=record.record("provenance").content,
    )


def _told(record: Record, key: str) -> float:
    """A number of an end; a length may be below zero, for an end that bends more."""
    return record.positive(key) if key == _ENDS["tip_offset_curvature"] else record.number(key)


def save_calibration(calibration: Calibration, path: str | Path) -> None:
    """Write a calibration file; a NaN or an infinity in it raises `ValueError` and writes nothing."""
    content = {
        "schema": SCHEMA,
        "version": VERSION,
        "layout": {
            "name": calibration.layout.name,
            "psi_rad": calibration.layout.psi,
            "pitch_m": calibration.layout.pitch,
        },
        "actuator": {
            "body_length_m": calibration.actuator.body_length,
            "cap_length_m": calibration.actuator.cap_length,
            "body_diameter_m": calibration.actuator.body_diameter,
            "mass_per_length_kg_per_m": calibration.actuator.mass_per_length,
            "cap_mass_kg": calibration.actuator.cap_mass,
            **{key: getattr(calibration.actuator, name) for name, key in _ENDS.items()},
        },
        "section_law": _law_record(calibration.section_law),
        "domain": {
            "pressure_max_pa": list(calibration.domain.pressure_max),
            "pressure_sum_max_pa": calibration.domain.pressure_sum_max,
            "moment_max_nm": calibration.domain.moment_max,
            "torque_max_nm": calibration.domain.torque_max,
        },
        "error": dict(calibration.error),
        "provenance": dict(calibration.provenance),
    }
    Path(path).write_text(json.dumps(content, allow_nan=False) + "\n", encoding="utf-8")


def _law_record(law: FileLaw) -> dict[str, Any]:
    if isinstance(law, OrientedNetwork):
        weights = np.asarray(law.orientation_weights).tolist()
        return {**_law_record(law.network), "kind": ORIENTED, "orientation_weights": weights}
    scales = {
        "pressure_scale_pa": law.pressure_scale,
        "curvature_scale_per_m": law.curvature_scale,
        "energy_scale_n": law.energy_scale,
        "rest_volume_m2": law.rest_volume,
    }
    if isinstance(law, RidgeNetwork):
        arrays = {name: np.asarray(getattr(law, name)).tolist() for name in _ARRAYS}
        return {"kind": RIDGES, "ridge_slope": RIDGE_SLOPE, **scales, "symmetry": law.symmetry, **arrays}
    return {
        "kind": EXPANSION,
        **scales,
        "pressure_warp_pa": law.pressure_warp,
        "mirror": law.mirror,
        "weights": [np.asarray(weight).tolist() for weight in law.weights],
        "biases": [np.asarray(bias).tolist() for bias in law.biases],
    }


def _read_law(record: Record) -> FileLaw:
    kinds = (RIDGES, ORIENTED, EXPANSION)
    kind = record.take("kind", " or ".join(f'"{kind}"' for kind in kinds), lambda value: value in kinds)
    scales = {
        "pressure_scale": record.positive("pressure_scale_pa"),
        "curvature_scale": record.positive("curvature_scale_per_m"),
        "energy_scale": record.positive("energy_scale_n"),
        "rest_volume": record.positive("rest_volume_m2"),
    }
    try:
        if kind == EXPANSION:
            return _read_expansion(record, scales)
        network = _read_ridge_network(record, scales)
        if kind == RIDGES:
            return network
        return OrientedNetwork(network, jnp.asarray(record.array("orientation_weights", 2)))
    except CalibrationFileError:
        raise
    except ValueError as error:
        raise CalibrationFileError(f"{record.file}: {record.place}: {error}") from error


def _read_ridge_network(record: Record, scales: Mapping[str, float]) -> RidgeNetwork:
    record.take("ridge_slope", f'"{RIDGE_SLOPE}"', lambda value: value == RIDGE_SLOPE)
    parts: dict[str, Any] = {name: jnp.asarray(record.array(name, rank)) for name, rank in _ARRAYS.items()}
    return RidgeNetwork(**{**parts, **scales}, symmetry=record.text("symmetry"))


def _read_expansion(record: Record, scales: Mapping[str, float]) -> FreeStateExpansion:
    return FreeStateExpansion(
        weights=tuple(jnp.asarray(weight) for weight in record.arrays("weights", rank=2)),
        biases=tuple(jnp.asarray(bias) for bias in record.arrays("biases", rank=1)),
        **scales,
        pressure_warp=record.positive_or_none("pressure_warp_pa"),
        mirror=record.flag("mirror"),
    )
