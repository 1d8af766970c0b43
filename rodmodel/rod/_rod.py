"""The differentiable rod: a section law, an actuator's dimensions, and the solve."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, final

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel.actuator import Actuator, Domain, Number
from rodmodel.error_bound import ErrorBound
from rodmodel.rod._inputs import vector_of
from rodmodel.rod._jacobian import Jacobian, jacobian_of
from rodmodel.rod._raising import raise_where
from rodmodel.rod._solve import messages, solve_rod
from rodmodel.section import SectionLaw
from rodmodel.statics import Adaptive, Loads, Numbers, Solution, Solver

if TYPE_CHECKING:
    import rodmodel.control


@final
class Rod(eqx.Module):
    """Soft actuator as an inextensible Cosserat rod with a clamped base and a rigid cap.

    By default the base is at the origin, the rod along +z at rest, chamber k at azimuth 120° (k − 1).
    `jax.jit`, `jax.vmap` and `jax.grad` work on [`rodmodel.Rod.solve`][]; `rodmodel.load` makes a rod from a
    calibration.

    Attributes
    ----------
    section : calibrated section law.
    actuator : dimensions and masses.
    domain : loads inside which the section was calibrated.
    error_bound : bound that the errors of 90 % of states keep; a number is a constant one of θ [rad].
    """

    section: SectionLaw
    actuator: Actuator
    domain: Domain
    error_bound: ErrorBound

    def __init__(
        self,
        section: SectionLaw,
        actuator: Actuator,
        domain: Domain,
        error_bound: ErrorBound | Number | None = None,
        *,
        angle_error: Number | None = None,
    ) -> None:
        """Make a rod; `angle_error`, the former name of a constant bound of θ [rad], serves as well."""
        given = angle_error if error_bound is None else error_bound
        if given is None or (angle_error is not None and error_bound is not None):
            came = "neither" if given is None else "both"
            raise TypeError(f"error_bound, angle_error: got {came}, expected one of the two")
        self.section = section
        self.actuator = actuator
        self.domain = domain
        self.error_bound = ErrorBound.of(given)

    def __hash__(self) -> int:
        """Hash all but the arrays, which have no hash, so that `jax.jit(rod.solve)` works."""
        return hash((self.actuator, self.domain, self.error_bound))

    @property
    def angle_error(self) -> Number:
        """Largest bound of θ without loads [rad]; deprecated: `error_bound` has it over the pressures."""
        warnings.warn(
            "Rod.angle_error: the bound depends on pressures and loads now: use Rod.error_bound, or "
            "error_estimate of a solution",
            DeprecationWarning,
            stacklevel=2,
        )
        return self.error_bound.largest_angle

    def solve(
        self,
        pressure: Numbers,
        tip_force: Numbers | None = None,
        tip_moment: Numbers | None = None,
        gravity: Numbers | None = None,
        throw: bool = True,
        *,
        distributed_force: Numbers | None = None,
        follower_force: Numbers | None = None,
        follower_moment: Numbers | None = None,
        base_position: Numbers | None = None,
        base_rotation: Numbers | None = None,
        start: Solution | None = None,
        solver: Solver = Adaptive(),  # noqa: B008 (frozen)
    ) -> Solution:
        """Solve for the equilibrium under chamber pressures and loads.

        Without loads the rod is an arc of the free curvature, in closed form. With loads the equations of
        the rod are integrated and solved by shooting, in load steps where they are needed to stay on the
        rod's branch. The equilibrium is the stable one that the rod reaches as the loads grow in proportion
        from zero. If the rod would snap before, or buckle to an undetermined side, the solve ends there
        without convergence; `result` gives the reason. A load that is not given costs nothing.

        Parameters
        ----------
        pressure : gauge pressures of chambers 1, 2 and 3, zero or positive [Pa].
        tip_force : dead force at the centre of the cap's outer face, world frame [N].
        tip_moment : dead moment on the cap, world frame [N m].
        gravity : acceleration, world frame [m/s²]: (0, 0, -9.81) for a rod that stands on its base.
        throw : raise an error for a pressure that is negative, not finite or outside the calibration, a load
            that is not finite, or a solve that fails. If false, these are flagged in the solution: under
            `jax.vmap`, for each row alone. A moment outside the calibration is only flagged, by `in_domain`.
        distributed_force : dead force along the body, per length, world frame [N/m].
        follower_force : force at the centre of the cap's outer face, in the frame of the cap, with which it
            turns [N].
        follower_moment : moment on the cap, in the frame of the cap, with which it turns [N m].
        base_position : position of the clamp, world frame [m]; by default the origin.
        base_rotation : frame of the clamp, directors as columns, (3, 3); by default the world frame.
        start : solution under nearby pressures and loads, from which Newton's method starts: faster if near.
            Its equilibrium is accepted and may be unstable, see `stable`; if it finds none, the solve
            restarts cold.
        solver : [`Adaptive`][], the reference, or [`FixedStep`][], for control.

        Returns
        -------
        solution : pose and shape, with flags and an error estimate.

        Raises
        ------
        ValueError
            For an argument of a wrong shape.
        RuntimeError
            See `throw`.

        Notes
        -----
        Derivatives are those of the equilibrium, by the implicit function theorem, in forward and reverse
        mode; second derivatives, forward over either. With loads and the adaptive solver, states along the
        rod are exact to 1e-8 of their range in double precision and 1e-4 in single, derivatives to 1e-6.
        """
        forces = {"tip_force": tip_force, "follower_force": follower_force}
        moments = {"tip_moment": tip_moment, "follower_moment": follower_moment}
        given = {
            **{name: vector_of(name, value, "components [N]") for name, value in forces.items()},
            **{name: vector_of(name, value, "components [N m]") for name, value in moments.items()},
            "gravity": vector_of("gravity", gravity, "components [m/s²]"),
            "distributed_force": vector_of("distributed_force", distributed_force, "components [N/m]"),
        }
        position = vector_of("base_position", base_position, "coordinates [m]")
        rotation = None if base_rotation is None else jnp.asarray(base_rotation, float)
        if rotation is not None and rotation.shape != (3, 3):
            raise ValueError(f"base_rotation: got shape {rotation.shape}, expected (3, 3): a rotation matrix")
        pressures = vector_of("pressure", pressure, "gauge pressures [Pa]")
        if pressures is None:
            raise ValueError("pressure: got None, expected three gauge pressures [Pa]")
        loads = Loads(**given)
        unknown = None if start is None else jax.lax.stop_gradient(start.unknown)
        unknowns = 3 if loads.follower_force is None else 6
        if unknown is not None and unknown.shape != (unknowns,):
            raise ValueError(
                f"start: got a solution with {unknown.shape} unknowns, expected ({unknowns},): both solves "
                "with a follower force, or both without"
            )
        solution, problems = solve_rod(
            self._in_arrays(), pressures, loads, position, rotation, unknown, solver
        )
        return raise_where(solution, problems, messages(self.domain)) if throw else solution

    def inverse(
        self,
        bending_angle: Numbers | None = None,
        bending_plane: Numbers | None = None,
        tip_position: Numbers | None = None,
        tip_force: Numbers | None = None,
        tip_moment: Numbers | None = None,
        gravity: Numbers | None = None,
        throw: bool = True,
    ) -> "rodmodel.control.Inverse":
        """Return pressures for a target bend, or a target position of the tip, with least co-contraction.

        Pressures stay within the calibrated domain. One chamber has no pressure wherever the target can be
        met so, to 0.15 % of the length or 1e-3 rad. For a target out of reach, `reached` is false, the
        pressures are the nearest that the search found, and `distance` is what remains.

        Parameters
        ----------
        bending_angle, bending_plane : target θ, zero or positive, and γ [rad]; both, or else `tip_position`.
        tip_position : target of the centre of the cap's outer face, world frame [m].
        tip_force, tip_moment, gravity : dead loads, as in [`rodmodel.Rod.solve`][].
        throw : raise an error for an input that is not finite, a negative angle, or a rod without an
            equilibrium under its loads. If false, these are flagged in the result. A target out of reach is
            no error.

        Returns
        -------
        inverse : pressures, whether they reach the target, and the solution at these pressures.

        Raises
        ------
        ValueError
            For an argument of a wrong shape, or a target that is neither a bend nor a position.
        RuntimeError
            See `throw`.
        """
        # Imported late: the compiled core does the search.
        from rodmodel.control import inverse_of_rod

        return inverse_of_rod(
            self, bending_angle, bending_plane, tip_position, tip_force, tip_moment, gravity, throw
        )

    def jacobian(
        self,
        pressure: Numbers,
        tip_force: Numbers | None = None,
        tip_moment: Numbers | None = None,
        gravity: Numbers | None = None,
        *,
        arc_lengths: Numbers = (),
        solver: Solver = Adaptive(),  # noqa: B008 (frozen)
        **loads: Any,
    ) -> tuple[Solution, Jacobian]:
        """Solve, and differentiate the pose by pressures, tip force, tip moment and gravity.

        Derivatives are those of the equilibrium, by the implicit function theorem. A load that is not given
        is zero.

        Parameters
        ----------
        pressure, tip_force, tip_moment, gravity, solver, loads : as for [`rodmodel.Rod.solve`][], with
            `throw` false.
        arc_lengths : arc lengths of the sections whose poses to differentiate besides the tip's [m].

        Returns
        -------
        solution : solution with its flags.
        jacobian : derivatives; if the solve has not converged, those of the equilibrium that it reached.
        """
        given = {"tip_force": tip_force, "tip_moment": tip_moment, "gravity": gravity}
        zero = jnp.zeros(3)
        inputs = {"pressure": jnp.asarray(pressure, float)}
        inputs |= {name: zero if load is None else jnp.asarray(load, float) for name, load in given.items()}
        other = {
            name: value if name == "start" else jnp.asarray(value, float) for name, value in loads.items()
        }
        s = jnp.asarray(arc_lengths, float)
        return self._in_arrays()._jacobian(inputs, s, other, solver)

    def predictor(self, loads: Sequence[str] = (), **options: Any) -> "rodmodel.control.Predictor":
        """Prepare this rod for a control loop: see [`rodmodel.Predictor`][] for the options."""
        from rodmodel.control import Predictor

        return Predictor(self, loads, **options)

    def _in_arrays(self) -> "Rod":
        """Return the rod with its numbers in arrays: rods whose arrays have equal shapes compile once."""
        alike = replace(self, error_bound=self.error_bound.padded)
        rod: Rod = jax.tree.map(lambda x: jnp.asarray(x, float) if isinstance(x, float | int) else x, alike)
        return rod

    @eqx.filter_jit
    def _jacobian(
        self, inputs: dict[str, Array], arc_lengths: Float[Array, " s"], other: dict[str, Any], solver: Solver
    ) -> tuple[Solution, Jacobian]:
        """Solve, and differentiate by each of the inputs."""

        def solve(inputs: dict[str, Any]) -> Solution:
            return self.solve(**inputs, throw=False, solver=solver, **other)

        return jacobian_of(solve, inputs, arc_lengths)
