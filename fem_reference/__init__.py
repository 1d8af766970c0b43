"""Full 3D finite-element reference of a wound soft pneumatic actuator."""

from fem_reference.actuator import Actuator, ActuatorError, ActuatorState
from fem_reference.actuator_load import ActuatorLoad
from fem_reference.actuator_record import load_record
from fem_reference.actuator_run import ActuatorRun, RunError
from fem_reference.cell import CellError, CellState, Load, PeriodCell, follow
from fem_reference.geometry import ActuatorGeometry
from fem_reference.level_record import level_from_record, level_record
from fem_reference.material import Ogden
from fem_reference.memory import keep_memory
from fem_reference.process import prepare_process
from fem_reference.records import (
    FLAG,
    Kind,
    Numbers,
    Object,
    OneOf,
    RecordError,
    Text,
    parse_record,
    read_record,
    refuse_faults,
)
from fem_reference.section import LEVELS, MeshLevel
from fem_reference.winding import LAYOUTS, DoubleHelix, NoWinding, Ring, SixHelix, Thread, Winding, layout

__all__ = [
    "FLAG",
    "LAYOUTS",
    "LEVELS",
    "Actuator",
    "ActuatorError",
    "ActuatorGeometry",
    "ActuatorLoad",
    "ActuatorRun",
    "ActuatorState",
    "CellError",
    "CellState",
    "DoubleHelix",
    "Kind",
    "Load",
    "MeshLevel",
    "NoWinding",
    "Numbers",
    "Object",
    "Ogden",
    "OneOf",
    "PeriodCell",
    "RecordError",
    "Ring",
    "RunError",
    "SixHelix",
    "Text",
    "Thread",
    "Winding",
    "follow",
    "keep_memory",
    "layout",
    "level_from_record",
    "level_record",
    "load_record",
    "parse_record",
    "prepare_process",
    "read_record",
    "refuse_faults",
]
