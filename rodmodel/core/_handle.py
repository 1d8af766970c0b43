"""A rod in the core's structures, with the arrays that these point to."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np

from rodmodel.actuator import Actuator, Domain
from rodmodel.core._law_data import LawData
from rodmodel.core._native import ffi, lib
from rodmodel.core._variants import VARIANTS, functions
from rodmodel.error_bound import ErrorBound

#: Fields of `rm_actuator`.
ENDS = (
    "body_length",
    "cap_length",
    "mass_per_length",
    "cap_mass",
    "stiff_tip",
    "base_turn",
    "base_lag",
    "base_stiffness",
    "base_growth",
    "tip_offset",
    "tip_offset_curvature",
    "tip_draw",
    "held_length",
    "shear_compliance",
)
#: Arrays of `rm_law` that lie in the structure itself.
IN_PLACE = ("slope", "quadratic", "slope_by_pressure", "pressure_quadratic")
# Alignment of arrays for aligned vector loads [bytes].
_ALIGNMENT = 64


def bound_numbers(error_bound: ErrorBound | float) -> dict[str, Any]:
    """Return the numbers of `rm_error_bound` by name."""
    bound = ErrorBound.of(error_bound).padded
    at_nodes = ("pressure_sum", "angle", "tip", "bending_angle", "angle_by_bend", "tip_by_bend")
    nodes = {name: [float(x) for x in getattr(bound, name)] for name in at_nodes}
    return {**nodes, **{name: float(getattr(bound, name)) for name in ("angle_per_moment", "tip_per_moment")}}


def domain_numbers(domain: Domain) -> dict[str, Any]:
    """Return the numbers of `rm_domain` by name; there, 0 stands for no limit beside a chamber."""
    beside = float(domain.beside_max)
    return {
        "pressure_max": [float(p) for p in domain.pressure_max],
        "pressure_sum_max": float(domain.pressure_sum_max),
        "moment_max": float(domain.moment_max),
        "torque_max": float(domain.moment_axes[2]),
        "beside_share": 0.0 if math.isinf(beside) else float(domain.beside_share),
        "beside_max": 0.0 if math.isinf(beside) else beside,
        "pressure_min": [float(p) for p in domain.pressure_min],
        "single_max": [float(p) for p in domain.single_max],
        "single_beside": float(domain.single_beside),
    }


class Handle:
    """A rod in the core: `rod` is its structure, `call` holds the core's functions.

    Parameters
    ----------
    law, actuator, domain, error_bound : data of the rod, with the law at one orientation; a bound that is a
        number is a constant one of θ [rad].
    variant : instruction set, one of `VARIANTS`; by default the fastest that the machine has.

    Raises
    ------
    ValueError
        For numbers that the core cannot use.
    """

    def __init__(
        self,
        law: LawData,
        actuator: Actuator,
        domain: Domain,
        error_bound: ErrorBound | float,
        variant: str = VARIANTS[-1],
    ) -> None:
        self.call: SimpleNamespace = functions(variant)
        self.rod: Any = ffi.new("rm_rod *")
        self._arrays: list[np.ndarray] = []
        into = self.rod.law
        for name, value in {**law.numbers, **law.sizes}.items():
            setattr(into, name, value)
        for name, array in law.arrays.items():
            if name in IN_PLACE:
                setattr(into, name, array.ravel().tolist())
            else:
                setattr(into, name, self._kept(array))
        self._orders = np.ascontiguousarray(law.orders, np.int32)
        into.orders = ffi.from_buffer("int *", self._orders)
        for name in ENDS:
            setattr(self.rod.actuator, name, float(getattr(actuator, name)))
        for name, value in domain_numbers(domain).items():
            setattr(self.rod.domain, name, value)
        for name, value in bound_numbers(error_bound).items():
            setattr(self.rod.error_bound, name, value)
        if self.call.rm_check_rod(self.rod) != lib.RM_SUCCESSFUL:
            raise ValueError(
                "law, actuator, domain: got a length, scale or limit that is not positive or not finite, "
                "expected those of a calibration"
            )

    def workspace(self, steps: int, with_jacobian: bool = False) -> Any:
        """Return a workspace for solves of so many steps; each thread needs its own."""
        size = self.call.rm_workspace_size(self.rod, steps, with_jacobian)
        return ffi.from_buffer("rm_real *", np.empty(size))

    def _kept(self, array: np.ndarray) -> Any:
        """Return a pointer to an aligned copy of an array that lives as long as this object."""
        raw = np.zeros(array.size + _ALIGNMENT // 8)
        first = -raw.ctypes.data % _ALIGNMENT // 8
        placed = raw[first : first + array.size]
        placed[:] = array.ravel()
        self._arrays.append(raw)
        return ffi.from_buffer("rm_real *", placed) if array.size else ffi.NULL
