"""Section laws: potential of curvature and pressure, per length of a uniform section."""

from rodmodel.section._free_state_expansion import FreeStateExpansion
from rodmodel.section._law import CurvatureLaw, Expansion, SectionLaw
from rodmodel.section._linear import LinearLaw
from rodmodel.section._nearby import LawNearby
from rodmodel.section._oriented_network import OrientedNetwork
from rodmodel.section._quartic import QuarticLaw
from rodmodel.section._ridge_network import SYMMETRIES, RidgeNetwork
from rodmodel.section._ridges import RidgeLaw
from rodmodel.section._turned import MirroredLaw, TurnedLaw
from rodmodel.section._unfolded import unfolded
from rodmodel.section._written_out import in_common_form

__all__ = [
    "SYMMETRIES",
    "CurvatureLaw",
    "Expansion",
    "FreeStateExpansion",
    "LawNearby",
    "LinearLaw",
    "MirroredLaw",
    "OrientedNetwork",
    "QuarticLaw",
    "RidgeLaw",
    "RidgeNetwork",
    "SectionLaw",
    "TurnedLaw",
    "in_common_form",
    "unfolded",
]
