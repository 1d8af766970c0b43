"""Run directories, records, VTK files and pictures."""

from fem_reference.io.actuator_picture import draw_actuator as draw_actuator
from fem_reference.io.actuator_record import load_record as load_record
from fem_reference.io.actuator_record import state_record as state_record
from fem_reference.io.actuator_vtk import ActuatorSeries as ActuatorSeries
from fem_reference.io.actuator_vtk import write_actuator_vtk as write_actuator_vtk
from fem_reference.io.cell_picture import draw_cell as draw_cell
from fem_reference.io.cell_vtk import write_vtk as write_vtk
from fem_reference.io.mesh_level_record import level_from_record as level_from_record
from fem_reference.io.mesh_level_record import level_record as level_record
from fem_reference.io.records import FLAG as FLAG
from fem_reference.io.records import Kind as Kind
from fem_reference.io.records import Numbers as Numbers
from fem_reference.io.records import Object as Object
from fem_reference.io.records import OneOf as OneOf
from fem_reference.io.records import RecordError as RecordError
from fem_reference.io.records import Text as Text
from fem_reference.io.records import parse_record as parse_record
from fem_reference.io.records import read_record as read_record
from fem_reference.io.records import refuse_faults as refuse_faults
from fem_reference.io.run_directory import ActuatorRun as ActuatorRun
from fem_reference.io.run_directory import RunError as RunError
