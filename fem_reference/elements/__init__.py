"""Elements: silicone, thread, chamber volume, tip face."""

from fem_reference.elements.chamber import Chamber as Chamber
from fem_reference.elements.ogden import Ogden as Ogden
from fem_reference.elements.solid import SolidElements as SolidElements
from fem_reference.elements.thread import ThreadSegments as ThreadSegments
from fem_reference.elements.thread_bending import ThreadBending as ThreadBending
from fem_reference.elements.tip_face import TipFace as TipFace
from fem_reference.elements.viscous_solid import ViscousSolid as ViscousSolid
