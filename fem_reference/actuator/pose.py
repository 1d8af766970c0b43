"""What is read from a deformed actuator: its axis, its bending angle θ and its bending plane γ."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from fem_reference.actuator.equations import ActuatorEquations
from fem_reference.rotations import nearest_rotation

# Sine of the polar angle below which an axis counts as straight.
_POLE = 1e-9


@dataclass(frozen=True)
class AxisShape:
    """The rod's axis and the silicone's sections around it, at every level of the mesh. SI units.

    Parameters
    ----------
    arc_length : s [m]; positions : r(s) [m].
    rotations : R(s): third column the axis' tangent, twist that of the silicone's section.
    curvature : u(s) in the frame R(s) [1/m]: of the axis, and the sections' twist.
    shear : turn about the first two directors, in the frame R(s) [rad], that takes the silicone's section to
        the plane across the axis: what a rod without shear leaves out.
    """

    arc_length: Float[np.ndarray, " levels"]
    positions: Float[np.ndarray, "levels 3"]
    rotations: Float[np.ndarray, "levels 3 3"]
    curvature: Float[np.ndarray, "levels 3"]
    shear: Float[np.ndarray, "levels 2"]


def axis_shape(equations: ActuatorEquations, positions: Float[np.ndarray, "points 3"]) -> AxisShape:
    """Read the axis and the sections' frames from a deformation in the body's units."""
    nodes, basis = equations.nodes, equations.basis
    rest = equations.rest_positions[:nodes]
    levels, index = np.unique(np.round(rest[:, 2], 9), return_inverse=True)
    controls = positions[nodes:]
    centre, slope, curve = (basis.values(levels, order) @ controls for order in range(3))
    tangent = slope / np.linalg.norm(slope, axis=1)[:, None]
    rotations = np.empty((len(levels), 3, 3))
    tilts = np.empty((len(levels), 3))
    for i in range(len(levels)):
        here = index == i
        arms = positions[:nodes][here] - centre[i]
        section = nearest_rotation(arms.T @ (rest[here] * [1.0, 1.0, 0.0]))
        # The section's frame, tilted by the least turn that takes its normal to the axis' tangent.
        tilt = np.cross(section[:, 2], tangent[i])
        sine = float(np.linalg.norm(tilt))
        angle = np.arctan2(sine, section[:, 2] @ tangent[i])
        tilts[i] = tilt / max(sine, 1e-300) * angle
        rotations[i] = Rotation.from_rotvec(tilts[i]).as_matrix() @ section
    bend = np.einsum("nji,nj->ni", rotations, np.cross(slope, curve))
    between = Rotation.from_matrix(np.swapaxes(rotations[:-1], 1, 2) @ rotations[1:]).as_rotvec()
    middle = 0.5 * (levels[1:] + levels[:-1])
    bend[:, 2] = np.interp(levels, middle, between[:, 2] / np.diff(levels))
    shear = np.einsum("nji,nj->ni", rotations, tilts)[:, :2]
    metre = equations.units.metre
    return AxisShape(levels / metre, centre / metre, rotations, bend * metre, shear)


def bending(tangents: Float[np.ndarray, "n 3"], chord: Float[np.ndarray, "3"]) -> tuple[float, float]:
    """Bending angle θ and bending plane γ [rad] of the tip.

    θ is the polar angle of the last tangent t from +z and γ the azimuth opposite to t, in [0, 2π). Past 180°
    θ is continued and γ stays that of the side to which the actuator went: half turns are counted along the
    axis in the vertical plane through the chord. Both are zero for a straight axis.

    Parameters
    ----------
    tangents : unit vectors along the axis, the last one normal to the cap's outer face.
    chord : from the base to the end of the body.

    References
    ----------
    "Modeling of a two-degree-of-freedom fiber-reinforced soft pneumatic actuator", Robotica (2023), eqs 1-4,
    with two-argument arctangents.
    """
    x, y, z = tangents[-1]
    sine = float(np.hypot(x, y))
    if sine < _POLE and z > 0.0:
        return 0.0, 0.0
    forward = tangents[:, :2] @ chord[:2] / max(float(np.hypot(*chord[:2])), np.finfo(float).tiny)
    turns = np.diff(np.arctan2(forward, tangents[:, 2])) / np.pi
    half_turns = int(abs((turns - 2.0 * np.round(0.5 * turns)).sum()))
    polar = float(np.arctan2(sine, z))
    back = half_turns % 2 == 1
    azimuth = np.arctan2(y, x) if back else np.arctan2(-y, -x)
    angle = np.pi * half_turns + (np.pi - polar if back else polar)
    # A rounding below zero is a whole turn after the modulus.
    return float(angle), float(azimuth % (2.0 * np.pi) % (2.0 * np.pi))
