"""Dimensions and windings of the actuator, and which values are plausible."""

from fem_reference.geometry.core import Core as Core
from fem_reference.geometry.dimensions import ActuatorGeometry as ActuatorGeometry
from fem_reference.geometry.dimensions import as_pressure as as_pressure
from fem_reference.geometry.dimensions import as_triple as as_triple
from fem_reference.geometry.dimensions import as_vector as as_vector
from fem_reference.geometry.paper import paper_number as paper_number
from fem_reference.geometry.paper import paper_numbers as paper_numbers
from fem_reference.geometry.plausible import BULK_TO_SHEAR as BULK_TO_SHEAR
from fem_reference.geometry.plausible import PLAUSIBLE as PLAUSIBLE
from fem_reference.geometry.plausible import refuse_curvature_beyond as refuse_curvature_beyond
from fem_reference.geometry.plausible import refuse_force_beyond as refuse_force_beyond
from fem_reference.geometry.plausible import refuse_implausible as refuse_implausible
from fem_reference.geometry.plausible import refuse_moment_beyond as refuse_moment_beyond
from fem_reference.geometry.plausible import refuse_pressure_beyond as refuse_pressure_beyond
from fem_reference.geometry.thread_library import THREADS as THREADS
from fem_reference.geometry.units import SI as SI
from fem_reference.geometry.units import Units as Units
from fem_reference.geometry.winding import COUPLINGS as COUPLINGS
from fem_reference.geometry.winding import LAYOUTS as LAYOUTS
from fem_reference.geometry.winding import DoubleHelix as DoubleHelix
from fem_reference.geometry.winding import NoWinding as NoWinding
from fem_reference.geometry.winding import Ring as Ring
from fem_reference.geometry.winding import SixHelix as SixHelix
from fem_reference.geometry.winding import Thread as Thread
from fem_reference.geometry.winding import Winding as Winding
from fem_reference.geometry.winding import layout as layout
