"""Section laws: potentials of curvature and pressure, per length of a uniform section."""

from rodmodel.section._common_form import in_common_form as in_common_form
from rodmodel.section._law import CurvatureLaw as CurvatureLaw
from rodmodel.section._law import SectionLaw as SectionLaw
from rodmodel.section._law_arrays import arrays_of as arrays_of
from rodmodel.section._law_arrays import law_from_arrays as law_from_arrays
from rodmodel.section._linear import LinearLaw as LinearLaw
from rodmodel.section._oriented_network import OrientedNetwork as OrientedNetwork
from rodmodel.section._ridge_law import RidgeLaw as RidgeLaw
from rodmodel.section._ridge_network import SYMMETRIES as SYMMETRIES
from rodmodel.section._ridge_network import RidgeNetwork as RidgeNetwork
from rodmodel.section._solve_3x3 import solve_3x3 as solve_3x3
from rodmodel.section._symmetry import MirroredLaw as MirroredLaw
from rodmodel.section._symmetry import TurnedLaw as TurnedLaw
from rodmodel.section._unfold import unfolded as unfolded
