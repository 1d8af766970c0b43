"""The calibration file: a section law and its actuator, from the FEM to the rod, as one JSON object.

    {"schema": "rodmodel-calibration", "version": 1,
     "layout": {"name", "psi_rad" (null for a law of all orientations), "pitch_m"},
     "actuator": {"body_length_m", "cap_length_m", "body_diameter_m",
                  "mass_per_length_kg_per_m", "cap_mass_kg", and, where known, "stiff_tip_m",
                  "base_turn_rad_per_pa", "base_lag_m", "base_stiffness_n_m2", "base_growth", "tip_offset_m",
                  "tip_offset_curvature_per_m", "held_length_m", "shear_compliance_per_n"},
     "section_law": {"kind", "ridge_slope", "pressure_scale_pa", "curvature_scale_per_m", "energy_scale_n",
                     "rest_volume_m2", "symmetry", and, by name, the arrays of `RidgeArrays`},
     "domain": {"pressure_max_pa" (three), "pressure_sum_max_pa", "moment_max_nm",
                "torque_max_nm" (null if equal), and, where known, "pressure_beside_share",
                "pressure_beside_max_pa", "pressure_min_pa" (three),
                "single_max_pa" (three), "single_beside_pa"},
     "snapped" (where known): laws after a snap of walls, see `rodmodel.io.snapped`,
     "jumps" (where known): runs of the full actuator that snap or stand, see `rodmodel.io.jumps`,
     "bound" (where known): {"pressure_sum_pa", "angle_rad", "tip_m" (a number at each node),
                             "angle_rad_per_nm", "tip_per_n", and, where known, "bending_angle_rad",
                             "angle_by_bend_rad", "tip_by_bend_m" (a number at each node)},
     "error": {"free_bending_angle_rad": {"median", "p95", "worst", and, where known, "p90"},
               and, where known, "actuator_angle_rad": {"p90"}, "measured_angle_rad": {"p90"}, ...},
     "provenance": {...}}

The law's kind is "ridge-network", "oriented-ridge-network" with "orientation_weights", or, for a law adjusted
to measurements, "adjusted-ridge-network" with "rest_pressures" and "quadratic". `error` may hold further
quantities and `provenance` is free; both are read back unchanged. `rodmodel.io.ranges` has the ranges of the
numbers.
"""

import json
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

from rodmodel.actuator import Actuator, Domain, Layout
from rodmodel.error_bound import MOST_NODES, ErrorBound
from rodmodel.io.atomic import write_atomically
from rodmodel.io.json_record import CalibrationFileError, Record
from rodmodel.io.jumps import Jump, jumps_content, jumps_of
from rodmodel.io.law_arrays import RidgeArrays
from rodmodel.io.law_record import domain_content, domain_of, law_content, law_of
from rodmodel.io.ranges import RANGES
from rodmodel.io.snapped import SnappedLaw, snapped_content, snapped_of

if TYPE_CHECKING:
    import rodmodel.section

SCHEMA = "rodmodel-calibration"
#: Schema of the former adjustment files; see `rodmodel.io.adjustment_file`.
ADJUSTMENT = "rodmodel-adjustment"
VERSION = 1
# Numbers of a bound: at nodes over the pressures' sum and over θ, the nodes first; by the moment on the base.
_NODES = {"pressure_sum": "pressure_sum_pa", "angle": "angle_rad", "tip": "tip_m"}
_BENT = {
    "bending_angle": "bending_angle_rad",
    "angle_by_bend": "angle_by_bend_rad",
    "tip_by_bend": "tip_by_bend_m",
}
_SLOPES = {"angle_per_moment": "angle_rad_per_nm", "tip_per_moment": "tip_per_n"}
_ACTUATOR = {
    "body_length": "body_length_m",
    "cap_length": "cap_length_m",
    "body_diameter": "body_diameter_m",
    "mass_per_length": "mass_per_length_kg_per_m",
    "cap_mass": "cap_mass_kg",
    "stiff_tip": "stiff_tip_m",
    "base_turn": "base_turn_rad_per_pa",
    "base_lag": "base_lag_m",
    "base_stiffness": "base_stiffness_n_m2",
    "base_growth": "base_growth",
    "tip_offset": "tip_offset_m",
    "tip_offset_curvature": "tip_offset_curvature_per_m",
    "tip_draw": "tip_draw_m3",
    "held_length": "held_length_m",
    "shear_compliance": "shear_compliance_per_n",
}


@final
@dataclass(frozen=True, init=False, eq=False)
class Calibration:
    """Content of a calibration file.

    Attributes
    ----------
    layout : winding layout.
    actuator : dimensions, masses and ends.
    law : section law as plain arrays; the constructor also takes a JAX law as `section_law`.
    domain : loads inside which the law was calibrated.
    error : errors on held-out states, as in the file.
    provenance : origin of the data, as in the file.
    bound : bound of the errors over pressures and loads, as in the file; None for a file without one.
    snapped : laws of the section after partition walls have snapped to one side, where they are known.
    jumps : where runs of the full actuator under one chamber left the loading branch, where there are any.

    Raises
    ------
    ValueError
        For a law that no file can hold, such as a `LinearLaw`.
    """

    layout: Layout
    actuator: Actuator
    law: RidgeArrays
    domain: Domain
    error: Mapping[str, Any]
    provenance: Mapping[str, Any]
    bound: ErrorBound | None = None
    snapped: tuple[SnappedLaw, ...] = ()
    jumps: tuple[Jump, ...] = ()

    def __init__(
        self,
        *,
        layout: Layout,
        actuator: Actuator,
        domain: Domain,
        error: Mapping[str, Any],
        provenance: Mapping[str, Any],
        bound: ErrorBound | None = None,
        snapped: tuple[SnappedLaw, ...] = (),
        jumps: tuple[Jump, ...] = (),
        law: RidgeArrays | None = None,
        section_law: "rodmodel.section.RidgeNetwork | rodmodel.section.OrientedNetwork | None" = None,
    ) -> None:
        if (law is None) == (section_law is None):
            raise ValueError(
                f"law, section_law: got {'neither' if law is None else 'both'}, expected one of the two"
            )
        if section_law is not None:
            from rodmodel.section import arrays_of

            law = arrays_of(section_law)
        if not isinstance(law, RidgeArrays):
            raise ValueError(
                f"law: got a {type(law).__name__}, expected RidgeArrays; section_law takes a RidgeNetwork or "
                "an OrientedNetwork, and a file holds no other law"
            )
        values = {
            "layout": layout,
            "actuator": actuator,
            "law": law,
            "domain": domain,
            "error": error,
            "provenance": provenance,
            "bound": bound,
            "snapped": snapped,
            "jumps": jumps,
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @cached_property
    def section_law(self) -> "rodmodel.section.RidgeNetwork | rodmodel.section.OrientedNetwork":
        """Differentiable section law; imports JAX."""
        from rodmodel.section import law_from_arrays

        return law_from_arrays(self.law)

    @property
    def error_bound(self) -> ErrorBound:
        """Bound that the errors of 90 % of states keep, over pressures and loads.

        A file without a bound has a constant one of the bending angle: the error against the period cell on
        held-out states and, if the file has it, that against the full actuator, on runs held out of the fit
        of the ends, as the root of the sum of their squares. The bound of a law adjusted to measurements is
        nowhere below the error against held-out measurements; that of the tip is not below the same error
        times the largest way of an arc's tip per angle, half of the body and the cap.
        """
        bound = self._constant_bound() if self.bound is None else self.bound
        measured = self.error.get("measured_angle_rad")
        if measured is None:
            return bound
        angle = float(measured["p90"])
        return bound.at_least(angle, angle * (0.5 * self.actuator.body_length + self.actuator.cap_length))

    @property
    def angle_error(self) -> float:
        """Largest bound of the bending angle without loads [rad]; deprecated, as `error_bound` has it all."""
        warnings.warn(
            "Calibration.angle_error: the bound depends on pressures and loads now: use "
            "Calibration.error_bound",
            DeprecationWarning,
            stacklevel=2,
        )
        return float(self.error_bound.largest_angle)

    def _constant_bound(self) -> ErrorBound:
        cell = self.error["free_bending_angle_rad"]
        bound = float(cell.get("p90", cell["p95"]))
        actuator = self.error.get("actuator_angle_rad")
        if actuator is not None:
            bound = math.hypot(bound, float(actuator["p90"]))
        return ErrorBound.constant(bound)


def read_calibration(path: str | Path) -> Calibration:
    """Read and validate a calibration file, or with a warning an adjustment file of the release before.

    Raises
    ------
    CalibrationFileError
        For a bad file; a `ValueError` whose one-line message names the file, the key, the value and what is
        expected.
    """
    record = Record.from_file(Path(path))
    if record.content.get("schema") == ADJUSTMENT:
        # Imported late: that module reads the adjusted calibration with this one.
        from rodmodel.io.adjustment_file import adjusted_calibration

        return adjusted_calibration(record)
    return _calibration(record)


def save_calibration(calibration: Calibration, path: str | Path) -> None:
    """Write a calibration file atomically.

    Raises
    ------
    ValueError
        For an argument that is no calibration, and for numbers that could not be read again: not finite, or
        out of their range. Nothing is written.
    OSError
        If the file cannot be written. An old file stays unchanged.
    """
    if not isinstance(calibration, Calibration):
        raise ValueError(
            f"calibration: got a {type(calibration).__name__}, expected a Calibration, which has layout, "
            "actuator, domain and errors besides the law"
        )
    content = {
        "schema": SCHEMA,
        "version": VERSION,
        "layout": {
            "name": calibration.layout.name,
            "psi_rad": calibration.layout.psi,
            "pitch_m": calibration.layout.pitch,
        },
        "actuator": {key: float(getattr(calibration.actuator, name)) for name, key in _ACTUATOR.items()},
        "section_law": law_content(calibration.law),
        "domain": domain_content(calibration.domain),
        **({} if calibration.bound is None else {"bound": _bound_content(calibration.bound)}),
        **({"snapped": snapped_content(calibration.snapped)} if calibration.snapped else {}),
        **({"jumps": jumps_content(calibration.jumps)} if calibration.jumps else {}),
        "error": dict(calibration.error),
        "provenance": dict(calibration.provenance),
    }
    text = json.dumps(content, allow_nan=False) + "\n"
    _calibration(Record.from_text(text, Path(path)))
    write_atomically(path, text)


def _bound_content(bound: ErrorBound) -> dict[str, Any]:
    keys = {**_NODES, **_BENT}
    nodes = {key: [float(x) for x in getattr(bound, name)] for name, key in keys.items()}
    return {**nodes, **{key: float(getattr(bound, name)) for name, key in _SLOPES.items()}}


def _calibration(record: Record) -> Calibration:
    record.take("schema", f'"{SCHEMA}"', lambda value: value == SCHEMA)
    record.take("version", f"version {VERSION}", lambda value: type(value) is int and value == VERSION)
    layout = record.record("layout")
    calibration = Calibration(
        layout=Layout(layout.word("name"), layout.number_or_null("psi_rad"), layout.number("pitch_m")),
        actuator=_actuator(record.record("actuator")),
        law=law_of(record.record("section_law")),
        domain=domain_of(record.record("domain")),
        bound=_bound(record.record("bound")) if "bound" in record.content else None,
        snapped=snapped_of(record),
        jumps=jumps_of(record),
        error=_error(record.record("error")),
        provenance=record.record("provenance").content,
    )
    if calibration.snapped and (calibration.law.is_oriented or calibration.law.is_adjusted):
        raise record.error("snapped", "laws beside one of all orientations or of measurements", "none")
    if (calibration.layout.psi is None) != calibration.law.is_oriented:
        law = "all orientations" if calibration.law.is_oriented else "one orientation"
        raise layout.error(
            "psi_rad",
            f"{calibration.layout.psi} with a law of {law}",
            "null with a law of all orientations and with no other",
        )
    return calibration


def _actuator(record: Record) -> Actuator:
    present = {
        name: record.number(key)
        for name, key in _ACTUATOR.items()
        if key in record.content or not RANGES[f"actuator.{key}"].optional
    }
    try:
        actuator = Actuator(**present)
    except ValueError as error:
        raise CalibrationFileError(f"{record.file}: {record.place}.{error}") from error
    length = actuator.body_length
    if actuator.stiff_tip >= length:
        raise record.error(
            "stiff_tip_m", f"{actuator.stiff_tip:g}", f"less than the body's length, {length:g} m"
        )
    for name in ("held_length", "base_lag", "tip_offset"):
        value = getattr(actuator, name)
        if abs(value) > length:
            raise record.error(_ACTUATOR[name], f"{value:g}", f"at most the body's length, {length:g} m")
    if abs(actuator.tip_draw) > length**3:
        most = f"at most the cube of the body's length, {length**3:g} m3"
        raise record.error("tip_draw_m3", f"{actuator.tip_draw:g}", most)
    return actuator


def _bound(record: Record) -> ErrorBound:
    nodes = _nodes(record, _NODES)
    if any(key in record.content for key in _BENT.values()):
        nodes |= _nodes(record, _BENT)
    slopes: dict[str, Any] = {name: record.number(key) for name, key in _SLOPES.items()}
    return ErrorBound(**nodes, **slopes)


def _nodes(record: Record, keys: Mapping[str, str]) -> dict[str, Any]:
    """Return a bound's nodes, which increase, and its terms at them, which do not decrease."""
    nodes = {name: record.nodes(key, MOST_NODES) for name, key in keys.items()}
    own = next(iter(keys))
    count = len(nodes[own])
    for name, key in keys.items():
        values = nodes[name]
        if len(values) != count:
            raise record.error(key, f"{len(values)} numbers", f"{count}, one at each of {keys[own]}")
        for before, after in pairwise(values):
            if after < before or (name == own and after == before):
                rising = "increasing" if name == own else "not decreasing"
                raise record.error(key, f"{after:g} after {before:g}", f"numbers that are {rising}")
    return nodes


def _error(record: Record) -> dict[str, Any]:
    cell = record.record("free_bending_angle_rad")
    for figure in ("median", "p95", "worst"):
        cell.number(figure)
    if "p90" in cell.content:
        cell.number("p90")
    for name in ("actuator_angle_rad", "measured_angle_rad"):
        if name in record.content:
            record.record(name).number("p90")
    return record.content
