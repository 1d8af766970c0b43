"""Full 3D finite-element reference of a wound soft pneumatic actuator.

A name is imported at its first use: a design can be read and checked without the packages that meshes need.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fem_reference.actuator import Actuator as Actuator
    from fem_reference.actuator import ActuatorError as ActuatorError
    from fem_reference.actuator import ActuatorLoad as ActuatorLoad
    from fem_reference.actuator import ActuatorState as ActuatorState
    from fem_reference.cell import CellError as CellError
    from fem_reference.cell import CellState as CellState
    from fem_reference.cell import Load as Load
    from fem_reference.cell import PeriodCell as PeriodCell
    from fem_reference.cell import follow as follow
    from fem_reference.cell import largest_stretch as largest_stretch
    from fem_reference.design import Design as Design
    from fem_reference.design import DesignError as DesignError
    from fem_reference.design import Similarity as Similarity
    from fem_reference.design import design_figure as design_figure
    from fem_reference.design import design_schema as design_schema
    from fem_reference.design import design_text as design_text
    from fem_reference.design import parse_design as parse_design
    from fem_reference.design import read_design as read_design
    from fem_reference.design import similarity as similarity
    from fem_reference.geometry import LAYOUTS as LAYOUTS
    from fem_reference.geometry import ActuatorGeometry as ActuatorGeometry
    from fem_reference.geometry import Core as Core
    from fem_reference.geometry import DoubleHelix as DoubleHelix
    from fem_reference.geometry import NoWinding as NoWinding
    from fem_reference.geometry import Ring as Ring
    from fem_reference.geometry import SixHelix as SixHelix
    from fem_reference.geometry import Thread as Thread
    from fem_reference.geometry import Winding as Winding
    from fem_reference.geometry import layout as layout
    from fem_reference.io import FLAG as FLAG
    from fem_reference.io import ActuatorRun as ActuatorRun
    from fem_reference.io import Kind as Kind
    from fem_reference.io import Numbers as Numbers
    from fem_reference.io import Object as Object
    from fem_reference.io import OneOf as OneOf
    from fem_reference.io import RecordError as RecordError
    from fem_reference.io import RunError as RunError
    from fem_reference.io import Text as Text
    from fem_reference.io import level_from_record as level_from_record
    from fem_reference.io import level_record as level_record
    from fem_reference.io import load_record as load_record
    from fem_reference.io import parse_record as parse_record
    from fem_reference.io import read_record as read_record
    from fem_reference.io import refuse_faults as refuse_faults
    from fem_reference.materials import Material as Material
    from fem_reference.materials import Ogden as Ogden
    from fem_reference.materials import Yeoh as Yeoh
    from fem_reference.materials import mooney_rivlin as mooney_rivlin
    from fem_reference.materials import neo_hookean as neo_hookean
    from fem_reference.mesh import LEVELS as LEVELS
    from fem_reference.mesh import MeshLevel as MeshLevel
    from fem_reference.mesh import converged_level as converged_level
    from fem_reference.mesh import mesh_level as mesh_level
    from fem_reference.runtime import keep_memory as keep_memory
    from fem_reference.runtime import prepare_process as prepare_process

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
    "Core",
    "Design",
    "DesignError",
    "DoubleHelix",
    "Kind",
    "Load",
    "Material",
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
    "Similarity",
    "SixHelix",
    "Text",
    "Thread",
    "Winding",
    "Yeoh",
    "converged_level",
    "design_figure",
    "design_schema",
    "design_text",
    "follow",
    "keep_memory",
    "largest_stretch",
    "layout",
    "level_from_record",
    "level_record",
    "load_record",
    "mesh_level",
    "mooney_rivlin",
    "neo_hookean",
    "parse_design",
    "parse_record",
    "prepare_process",
    "read_design",
    "read_record",
    "refuse_faults",
    "similarity",
]

_HOMES = {
    "fem_reference.actuator": (
        "Actuator",
        "ActuatorError",
        "ActuatorLoad",
        "ActuatorState",
    ),
    "fem_reference.cell": (
        "CellError",
        "CellState",
        "Load",
        "PeriodCell",
        "follow",
        "largest_stretch",
    ),
    "fem_reference.design": (
        "Design",
        "DesignError",
        "Similarity",
        "design_schema",
        "design_text",
        "design_figure",
        "parse_design",
        "read_design",
        "similarity",
    ),
    "fem_reference.geometry": (
        "LAYOUTS",
        "ActuatorGeometry",
        "Core",
        "DoubleHelix",
        "NoWinding",
        "Ring",
        "SixHelix",
        "Thread",
        "Winding",
        "layout",
    ),
    "fem_reference.io": (
        "FLAG",
        "ActuatorRun",
        "Kind",
        "Numbers",
        "Object",
        "OneOf",
        "RecordError",
        "RunError",
        "Text",
        "level_from_record",
        "level_record",
        "load_record",
        "parse_record",
        "read_record",
        "refuse_faults",
    ),
    "fem_reference.materials": (
        "Material",
        "Ogden",
        "Yeoh",
        "mooney_rivlin",
        "neo_hookean",
    ),
    "fem_reference.mesh": (
        "LEVELS",
        "MeshLevel",
        "converged_level",
        "mesh_level",
    ),
    "fem_reference.runtime": (
        "keep_memory",
        "prepare_process",
    ),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(import_module(_HOME[name]), name)
        globals()[name] = value  # later uses skip this function
        return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
