"""Elements: silicone, thread, chamber volume, tip face; their force groups and the assembly."""

from fem_reference.elements.assembly import Assembled as Assembled
from fem_reference.elements.assembly import Entries as Entries
from fem_reference.elements.assembly import assemble as assemble
from fem_reference.elements.assembly import assemble_forces as assemble_forces
from fem_reference.elements.assembly import convexified as convexified
from fem_reference.elements.assembly import local_dofs as local_dofs
from fem_reference.elements.assembly import own_after as own_after
from fem_reference.elements.assembly import patch_names as patch_names
from fem_reference.elements.assembly import pressure_groups as pressure_groups
from fem_reference.elements.assembly import total_energy as total_energy
from fem_reference.elements.chamber import Chamber as Chamber
from fem_reference.elements.force_group import DisplacementGroup as DisplacementGroup
from fem_reference.elements.force_group import ForceGroup as ForceGroup
from fem_reference.elements.force_group import Forces as Forces
from fem_reference.elements.force_group import Own as Own
from fem_reference.elements.force_group import Points as Points
from fem_reference.elements.force_group import Response as Response
from fem_reference.elements.force_group import SolidGroup as SolidGroup
from fem_reference.elements.force_group import StiffGroup as StiffGroup
from fem_reference.elements.force_group import ThreadGroup as ThreadGroup
from fem_reference.elements.force_group import lengthening as lengthening
from fem_reference.elements.solid import SolidElements as SolidElements
from fem_reference.elements.thread import ThreadSegments as ThreadSegments
from fem_reference.elements.thread_bending import ThreadBending as ThreadBending
from fem_reference.elements.tip_face import TipFace as TipFace
from fem_reference.elements.viscous_solid import ViscousSolid as ViscousSolid
