"""Equilibrium of the full actuator: residual and stiffness in the nodes and the rod's control points.

Total energy (N, mm, MPa), to which a follower load adds a force without one:

    E(x, P, p) = solid + thread + rod's curve + cavity on rod + walls − Σ_k p_k V_k − loads' work.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from fem_reference.actuator.load import ActuatorTarget
from fem_reference.actuator.model import ActuatorLinearisation, Deformation
from fem_reference.actuator.parts import ActuatorParts
from fem_reference.algebra import scatter
from fem_reference.elements import ViscousSolid


class ActuatorEquations(ActuatorParts):
    """The energy's gradient and Hessian, and steps in all unknowns; see `ActuatorParts` for the parts."""

    def linearise(
        self,
        at: Deformation,
        target: ActuatorTarget,
        exact: bool = False,
        viscous: ViscousSolid | None = None,
        before: ActuatorLinearisation | None = None,
    ) -> ActuatorLinearisation:
        """Residual and stiffness.

        Parameters
        ----------
        at : unknowns; target : pressures and loads.
        exact : take the stiff parts' forces from the deformation, so that the matrix is the Hessian of the
            energy even away from equilibrium.
        viscous : resistance in a step in time.
        before : where the last step was taken; see `Problem.linearise`.
        """
        x = at.positions
        controls = x[self.nodes :]
        solid = self.solid.response(x, None if exact else at.element_pressure)
        if viscous is not None:
            solid[0][:] += viscous.force(x)
            solid[1][:] += viscous.matrices
        thread = self.thread.response(x, None if exact else at.segment_tension)
        axis = self.axis.response(controls, self.axis.tension(controls) if exact else at.axis_tension)
        walls = self.walls.iterate(x, None if before is None else before.pairs)
        parts = [solid[:2], thread[:2], *(joints.response(x) for joints in self.joints)]
        for p, chamber in zip(target.pressure, self.chambers, strict=True):
            parts += [(-p * patch.gradient(x), -p * patch.hessian(x)) for patch in chamber.patches]
        parts += [axis[:2], self.bond.response(x), self.contact.response(x)]

        force = np.zeros_like(x)
        force[self.nodes :] = self.axis.bending @ controls
        if walls is not None:
            force += walls[0]
            entries = self._unknowns.entries
            wall_entries = entries(walls[1])
            self.pattern.cover(*wall_entries[:2], lambda: entries(self.walls.neighbours(x))[:2])
        data = np.zeros(len(self.pattern))
        if walls is not None:
            self.pattern.add_entries(data, *wall_entries)
        for group, (points, (local_force, local_stiffness)) in enumerate(
            zip(self._connectivities(), parts, strict=True)
        ):
            force += scatter(points, local_force, len(x))
            self.pattern.add_group(data, group, local_stiffness)
        self.pattern.add_entries(data, *self._bending)

        load, columns, rows = self._load(x, target)
        return ActuatorLinearisation(
            residual=self.fold @ (force - load).ravel(),
            data=data,
            walls_touch=walls is not None,
            pairs=None if walls is None else walls[2],
            slack=self.thread.slack(at.segment_tension),
            positions=x,
            force=force,
            load_columns=columns,
            load_rows=rows,
            volume_gradient=solid[2],
            constitutive=solid[3],
            length_gradient=thread[2],
            extension_gradient=axis[2],
        )

    def update_forces(
        self,
        linear: ActuatorLinearisation,
        at: Deformation,
        target: ActuatorTarget,
        viscous: ViscousSolid | None = None,
    ) -> ActuatorLinearisation:
        """The residual taken anew, with the stiffness of ``linear``; see `linearise`."""
        x = at.positions
        controls = x[self.nodes :]
        walls = self.walls.force(x)
        solid, constitutive = self.solid.force(x)
        parts = [
            solid if viscous is None else solid + viscous.force(x),
            self.thread.force(x, at.segment_tension),
        ]
        parts += [joints.force(x) for joints in self.joints]
        for p, chamber in zip(target.pressure, self.chambers, strict=True):
            parts += [-p * patch.gradient(x) for patch in chamber.patches]
        parts += [self.axis.force(controls), self.bond.force(x), self.contact.force(x)]
        force = np.zeros_like(x) if walls is None else walls
        force[self.nodes :] += self.axis.bending @ controls
        for points, local in zip(self._connectivities(), parts, strict=True):
            force += scatter(points, local, len(x))
        load, *_ = self._load(x, target)
        return replace(
            linear,
            residual=self.fold @ (force - load).ravel(),
            walls_touch=walls is not None,
            positions=x,
            force=force,
            constitutive=constitutive,
        )

    def reaction(
        self, linear: ActuatorLinearisation, target: ActuatorTarget
    ) -> Float[np.ndarray, "points 3"]:
        """Force of the clamp on every point [N]; zero where nothing is clamped."""
        load, *_ = self._load(linear.positions, target)
        return np.where(self.clamped, self.symmetrised(linear.force - load), 0.0)

    def convexified_contact(self, linear: ActuatorLinearisation) -> Float[np.ndarray, " nonzeros"]:
        """See `Problem.convexified_contact`."""
        x, data = linear.positions, linear.data.copy()
        concave = self.walls.concave_part(x)
        if concave is not None:
            self.pattern.add_entries(data, *self._unknowns.entries(-concave))
        return data

    def core_curvature_stiffness(self, linear: ActuatorLinearisation) -> Float[np.ndarray, " nonzeros"]:
        """See `Problem.core_curvature_stiffness`."""
        data = np.zeros(len(self.pattern))
        concave = self.contact.concave_part(linear.positions)
        self.pattern.add_group(data, len(self._connectivities()) - 1, concave)
        return data

    def _load(
        self, x: Float[np.ndarray, "points 3"], target: ActuatorTarget
    ) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None]:
        """Weight and tip load at every point [N], and the tip load's own stiffness."""
        load = self.mass[:, None] * target.gravity
        if not (target.tip_force.any() or target.tip_moment.any()):
            return load, None, None
        frame = self.tip.frame(x)
        turn = frame.rotation if target.follower else np.eye(3)
        resultant = (turn @ target.tip_force, turn @ target.tip_moment)
        load[self.tip.nodes] += self.tip.forces(frame, *resultant)
        columns, rows = np.zeros((*x.shape, 3)), np.zeros((3, *x.shape))
        columns[self.tip.nodes] = self.tip.stiffness_columns(frame, *resultant, target.follower)
        rows[:, self.tip.nodes] = self.tip.rotation_rows(frame)
        return load, self.fold @ columns.reshape(-1, 3), (self.fold @ rows.reshape(3, -1).T).T

    def advance(
        self,
        at: Deformation,
        step: Float[np.ndarray, "points 3"],
        fraction: float,
        linear: ActuatorLinearisation,
    ) -> Deformation:
        """Take a fraction of a Newton step, with the condensed forces of the stiff parts."""
        x, thread, axis = linear.positions, self.thread, self.axis
        stretch = _contract(linear.length_gradient, step[thread.connectivity])
        extension = _contract(linear.extension_gradient, step[self.nodes + axis.connectivity])
        pressure = self.solid.pressure_after(linear.constitutive, linear.volume_gradient, step)
        tension = thread.tension_after(x, at.segment_tension, stretch)
        axial = axis.tension(x[self.nodes :]) + axis.axial_stiffness / self.basis.span * extension
        return Deformation(
            positions=at.positions + fraction * step,
            element_pressure=at.element_pressure + fraction * (pressure - at.element_pressure),
            segment_tension=at.segment_tension + fraction * (tension - at.segment_tension),
            axis_tension=at.axis_tension + fraction * (axial - at.axis_tension),
        )


def _contract(gradient: np.ndarray, local: np.ndarray) -> np.ndarray:
    return np.einsum("ba,ba->b", gradient, local.reshape(len(gradient), gradient.shape[1]))
