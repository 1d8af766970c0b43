"""Rotations, the shape of the rod's axis, bending angle and bending plane."""

from rodmodel.kinematics._bending import bend as bend
from rodmodel.kinematics._bending import bending as bending
from rodmodel.kinematics._integral import integral_weights as integral_weights
from rodmodel.kinematics._integral import middle_matrix as middle_matrix
from rodmodel.kinematics._rotation import cross_matrix as cross_matrix
from rodmodel.kinematics._rotation import rotation_of as rotation_of
from rodmodel.kinematics._rotation import screw as screw
from rodmodel.kinematics._rotation import turn_change as turn_change
from rodmodel.kinematics._shape import Arc as Arc
from rodmodel.kinematics._shape import Shape as Shape
from rodmodel.kinematics._shape import Stepped as Stepped
