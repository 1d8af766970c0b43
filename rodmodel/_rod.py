"""The rod: a section law, an actuator's dimensions, and the solve."""

from functools import reduce
from typing import final

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel._bending import bending
from rodmodel._equilibrium import Equilibrium, Loads, split
from rodmodel._inverse import Inverse, Target, find_pressure
from rodmodel._shape import Arc, Polynomial, Shape
from rodmodel._solution import Numbers, Solution
from rodmodel.calibration_file import Actuator, Domain
from rodmodel.section import CurvatureLaw, SectionLaw

# Of one integration step with loads, by precision.
_TOLERANCES = {"float64": 1e-10, "float32": 1e-5}


@final
class Rod(eqx.Module):
    """Soft actuator as an inextensible Cosserat rod of uniform section, with a clamped base and a rigid cap.

    The base is at the origin, the rod along +z at rest, chamber k at azimuth 120° (k − 1). `jax.jit`,
    `jax.vmap` and `jax.grad` work on [`Rod.solve`][]; `rodmodel.load` makes a rod from a calibration.

    Attributes
    ----------
    section : the calibrated law of the section.
    actuator : lengths and masses.
    domain : the loads within which the section was calibrated.
    angle_error : 95th percentile of the error of the free-bending angle on held-out states [rad].
    """

    section: SectionLaw
    actuator: Actuator = eqx.field(static=True)
    domain: Domain = eqx.field(static=True)
    angle_error: float = eqx.field(static=True)

    def __hash__(self) -> int:
        """Hash of all but the arrays, which have none, so that `jax.jit(rod.solve)` works."""
        return hash((self.actuator, self.domain, self.angle_error))

    def solve(
        self,
        pressure: Numbers,
        tip_force: Numbers | None = None,
        tip_moment: Numbers | None = None,
        gravity: Numbers | None = None,
        throw: bool = True,
    ) -> Solution:
        """Equilibrium under chamber pressures and dead loads.

        Without loads the rod is an arc of the free curvature, in closed form. With loads the equations of
        [`rodmodel._equilibrium.Equilibrium`][] are integrated and solved by shooting; where it takes that to
        stay with the rod, the loads grow in proportion from zero. The equilibrium is the stable one that the
        rod goes to. Where it would snap, or buckle to no side in particular, the solve ends there without
        convergence. A load that is not given costs nothing.

        Parameters
        ----------
        pressure : gauge pressures of chambers 1, 2 and 3, zero or positive [Pa].
        tip_force : at the centre of the cap's outer face, world frame, dead [N].
        tip_moment : on the cap, world frame, dead [N m].
        gravity : acceleration, world frame [m/s²]: (0, 0, -9.81) for a rod that stands on its base.
        throw : raise where the pressure is negative, not finite or outside the calibration, a load is not
            finite, or the solve fails. If false, these are flagged in the solution: under `jax.vmap`, for
            each row alone. A moment outside the calibration is only ever flagged, by `in_domain`.

        Returns
        -------
        solution : the pose and the shape, with flags and an error estimate.

        Raises
        ------
        ValueError
            Where an argument is not three numbers.
        RuntimeError
            See `throw`.

        Notes
        -----
        Derivatives are those of the equilibrium, by the implicit function theorem, in forward and reverse
        mode; second ones, forward over either. With loads, states along the rod are exact to 1e-8 of their
        range in double precision and 1e-4 in single, and so are derivatives.
        """
        loads = Loads(
            tip_force=None if tip_force is None else _vector("tip_force", tip_force, "components [N]"),
            tip_moment=None if tip_moment is None else _vector("tip_moment", tip_moment, "components [N m]"),
            gravity=None if gravity is None else _vector("gravity", gravity, "components [m/s²]"),
        )
        return self._solve(_vector("pressure", pressure, "gauge pressures [Pa]"), loads, throw)

    def inverse(
        self,
        bending_angle: Numbers | None = None,
        bending_plane: Numbers | None = None,
        tip_position: Numbers | None = None,
        tip_force: Numbers | None = None,
        tip_moment: Numbers | None = None,
        gravity: Numbers | None = None,
        throw: bool = True,
    ) -> Inverse:
        """Pressures for a wanted bend, or for a wanted position of the tip, with least co-contraction.

        Pressures stay within the calibrated domain. One chamber stays without pressure wherever the target
        can be met so, to 0.1 mm or 1e-3 rad. A target out of reach is answered with the pressures that come
        nearest to it; `reached` tells, and `distance` how near. Where that is depends on the start: the
        search is local, from three sides.

        Parameters
        ----------
        bending_angle, bending_plane : θ, zero or positive, and γ [rad]; both, or else the next.
        tip_position : of the centre of the cap's outer face, world frame [m].
        tip_force, tip_moment, gravity : dead loads, as in [`Rod.solve`][].
        throw : raise where an input is not finite, an angle is negative, or the rod has no equilibrium under
            its loads. If false, these are flagged in the result: under `jax.vmap`, for each row alone. A
            target out of reach is no error.

        Returns
        -------
        inverse : pressures, whether they reach the target, and the solution at them. A batch is quicker by
            `jax.lax.map`, where no row waits for the slowest of them.

        Raises
        ------
        ValueError
            Where an argument has not the shape it must have, or the target is not one of the two.
        RuntimeError
            See `throw`.
        """
        length = self.actuator.body_length + self.actuator.cap_length
        target = Target.of(bending_angle, bending_plane, tip_position, length)
        loads = {"tip_force": tip_force, "tip_moment": tip_moment, "gravity": gravity}
        given = {name: jnp.asarray(load, float) for name, load in loads.items() if load is not None}
        free = eqx.Partial(Rod.solve, self, throw=False)
        solve = eqx.Partial(Rod.solve, self, throw=False, **given)
        return find_pressure(solve, free if given else None, self.domain, target, throw)

    @eqx.filter_jit
    def _solve(self, pressure: Float[Array, "3"], loads: Loads, throw: bool) -> Solution:
        good_pressure = jnp.all(jnp.isfinite(pressure) & (pressure >= 0.0))
        good_loads = reduce(
            jnp.logical_and, (jnp.all(jnp.isfinite(load)) for load in jax.tree.leaves(loads)), jnp.array(True)
        )
        good = good_pressure & good_loads
        # A row that cannot be solved is solved for zeros: its NaN would keep the rest of a batch iterating.
        pressure, loads = jax.tree.map(lambda x: jnp.where(good, x, 0.0), (pressure, loads))

        one = jnp.ones_like(pressure[0])
        law = self.section.at(pressure)
        shape: Shape
        if jax.tree.leaves(loads):
            shape, stats = _loaded_shape(law, loads, self.actuator)
        else:
            shape = Arc(base_curvature=law.free_curvature, length=self.actuator.body_length)
            none = jnp.zeros((), int)
            stats = {"load_fraction": one, "load_steps": none, "shots": none}

        pressure_in_domain = self.domain.covers_pressure(pressure)
        moments = jax.vmap(law.moment)(shape.curvatures()[0])
        in_domain = good & pressure_in_domain & jnp.all(jax.vmap(self.domain.covers_moment)(moments))
        positions, rotations = shape.poses()
        angle, plane = bending(rotations[:, :, 2], positions[-1])
        tip_position = positions[-1] + self.actuator.cap_length * rotations[-1, :, 2]
        solution = Solution(
            tip_position=tip_position,
            tip_rotation=rotations[-1],
            bending_angle=angle,
            bending_plane=plane,
            chamber_volume=self._chamber_volume(pressure, shape),
            converged=good & (stats["load_fraction"] == 1.0) & jnp.all(jnp.isfinite(tip_position)),
            in_domain=in_domain,
            error_estimate=jnp.where(in_domain, self.angle_error * one, jnp.nan),
            stats=stats,
            shape=shape,
            cap_length=self.actuator.cap_length,
        )
        solution = jax.tree.map(
            lambda x: jnp.where(good, x, jnp.nan) if eqx.is_inexact_array(x) else x, solution
        )
        if not throw:
            return solution
        problems = jnp.logical_not(
            jnp.array([good_pressure, good_loads, pressure_in_domain, solution.converged])
        )
        return eqx.branched_error_if(solution, jnp.any(problems), jnp.argmax(problems), self._messages())

    def _chamber_volume(self, pressure: Float[Array, "3"], shape: Shape) -> Float[Array, "3"]:
        """Volume −∂/∂p ∫ Π(u(s), p) ds at a fixed shape [m³]: one derivative for all sections."""
        curvatures, weights = shape.curvatures()

        def potential(pressure: Float[Array, "3"]) -> Float[Array, ""]:
            return weights @ jax.vmap(self.section.at(pressure).energy)(curvatures)

        return -jax.jacfwd(potential)(pressure)

    def _messages(self) -> list[str]:
        first, second, third = self.domain.pressure_max
        flagged = "throw=False flags this in the solution instead"
        return [
            f"pressure: got a negative value or one that is not finite, expected 0 or more Pa; {flagged}",
            f"tip_force, tip_moment or gravity: got a value that is not finite, expected finite; {flagged}",
            "pressure: got more than the calibration covers, "
            f"expected at most {first:g}, {second:g}, {third:g} Pa in chambers 1, 2, 3 "
            f"and {self.domain.pressure_sum_max:g} Pa in sum; throw=False extrapolates",
            "solve: no equilibrium was found under the full load, expected a load that the rod can carry; "
            "throw=False returns the equilibrium at the largest fraction of it that was reached",
        ]


def _loaded_shape(law: CurvatureLaw, loads: Loads, actuator: Actuator) -> tuple[Shape, dict[str, Array]]:
    # Imported late: a rod without loads does not need diffrax, which takes a while to import.
    from rodmodel._shooting import shoot

    dtype = law.free_curvature.dtype
    shot = shoot(Equilibrium(law, loads, actuator), _TOLERANCES[dtype.name])
    positions, quaternions, turns = split(shot.states)
    length = actuator.body_length
    shape = Polynomial(
        positions=length * positions, quaternions=quaternions, node_curvatures=turns / length, length=length
    )
    return shape, {
        "load_fraction": shot.load_fraction,
        "load_steps": shot.load_steps,
        "shots": shot.shots,
    }


def _vector(name: str, value: Numbers, what: str) -> Float[Array, "3"]:
    """Argument as three numbers of the default precision, or an error that names it."""
    try:
        vector = jnp.asarray(value, float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: got {value!r}, expected three {what}") from error
    if vector.shape != (3,):
        raise ValueError(f"{name}: got shape {vector.shape}, expected (3,): three {what}")
    return vector
