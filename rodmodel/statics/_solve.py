"""Solve by fixed or adaptive steps, with derivatives by the implicit function theorem."""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jax import custom_derivatives
from jaxtyping import Array, Float

from rodmodel.actuator import Actuator
from rodmodel.kinematics import Arc, Shape, Stepped
from rodmodel.section import CurvatureLaw
from rodmodel.statics._equilibrium import Equilibrium, State
from rodmodel.statics._loads import Loads, resultants
from rodmodel.statics._sensitivity import equilibrium_change
from rodmodel.statics._shooting import ARRIVED, ShootingState, shoot
from rodmodel.statics._stability import is_positive
from rodmodel.statics._steps import march

# Default tolerance of Newton's method on u L [rad], and of an adaptive integration step.
_TOLERANCE = {"float64": 1e-10, "float32": 1e-5}

# Equal parts of the body between the nodes of the adaptive solver's result.
_NODES = 64


@dataclass(frozen=True)
class FixedStep:
    """Solver with a fixed number of steps along the rod, of order 4, as in the compiled core.

    Attributes
    ----------
    steps : number of steps. The error at the tip falls with its fourth power.
    tolerance : tolerance of Newton's method on u L at the base [rad]; by default 1e-10, or 1e-5 in single
        precision.
    """

    steps: int = 8
    tolerance: float | None = None

    def __post_init__(self) -> None:
        """Refuse a number of steps below 1 and an impossible tolerance."""
        if self.steps < 1:
            raise ValueError(f"steps: got {self.steps}, expected 1 or more")
        _check_tolerance(self.tolerance)


@dataclass(frozen=True)
class Adaptive:
    """Reference solver: adaptive steps along the rod, of order 8, that keep a tolerance.

    Attributes
    ----------
    tolerance : tolerance of one step, relative and absolute, on r/L, R and u L, and of Newton's method on u L
        at the base [rad]; by default 1e-10, or 1e-5 in single precision.
    """

    tolerance: float | None = None

    def __post_init__(self) -> None:
        """Refuse an impossible tolerance."""
        _check_tolerance(self.tolerance)


Solver = FixedStep | Adaptive


def _check_tolerance(tolerance: float | None) -> None:
    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise ValueError(f"tolerance: got {tolerance}, expected a number between 0 and 1, or None")


def solve_shape(
    law: CurvatureLaw,
    loads: Loads,
    actuator: Actuator,
    offset: Float[Array, "3"],
    start: Float[Array, " n"] | None,
    solver: Solver,
) -> tuple[Shape, ShootingState, Float[Array, "3"] | None]:
    """Solve for the shape of the body: without loads an arc of the free curvature, in closed form.

    Parameters
    ----------
    law : section law at the pressures.
    loads : loads in the frame of the first section.
    actuator : dimensions and masses.
    offset : offset of the cap from the body's end, in its frame [m].
    start : unknowns to start from.
    solver : solver for a rod with loads.

    Returns
    -------
    shape : shape of the body's axis.
    reached : equilibrium at which the solve ended.
    push : force on the cap, in its frame [N]; None without loads.
    """
    free, length = law.free_curvature, actuator.bending_length
    if not jax.tree.leaves(loads):
        zero, one = jnp.zeros((), int), jnp.ones((), free.dtype)
        empty = State(jnp.zeros((0, 3)), jnp.zeros((0, 3, 3)), jnp.zeros((0, 3)))
        stable = is_positive(law.stiffness(free))
        arrived = ShootingState(length * free, empty, one, zero, zero, stable, zero + ARRIVED)
        return Arc(base_curvature=free, length=length), arrived, None
    equilibrium = Equilibrium(law, resultants(loads, actuator, free.dtype), actuator, offset)
    reached = solve_equilibrium(equilibrium, start, solver)
    loaded, nodes, unknown = equilibrium.scaled(reached.load_fraction), reached.nodes, reached.unknown

    def slopes(s: Float[Array, ""], R: Float[Array, "3 3"], turn: Float[Array, "3"]) -> tuple[Array, Array]:
        """Return the slope of u L, and the shear part of r', at a node."""
        force = R.T @ loaded.force(s, unknown)
        drift = R @ (loaded.direction(force) - jnp.array([0.0, 0.0, 1.0], turn.dtype))
        return loaded.turn_rate(force, turn), drift

    fractions = jnp.linspace(0.0, 1.0, nodes.turn.shape[0], dtype=free.dtype)
    rates, drifts = jax.vmap(slopes)(fractions, nodes.rotation, nodes.turn)
    shape = Stepped(
        positions=length * nodes.position,
        rotations=nodes.rotation,
        node_curvatures=nodes.turn / length,
        node_slopes=rates / length**2,
        node_drifts=drifts,
        length=length,
    )
    return shape, reached, loaded.push(nodes.rotation[-1], unknown)


@partial(jax.custom_jvp, nondiff_argnums=(2,))
def solve_equilibrium(
    equilibrium: Equilibrium, start: Float[Array, " n"] | None, solver: Solver
) -> ShootingState:
    """Solve with one of the solvers; see `shoot`.

    Derivatives are those of the equilibrium at the load fraction reached, not of the iterations.
    """
    tolerance = solver.tolerance or _TOLERANCE[equilibrium.law.free_curvature.dtype.name]
    if isinstance(solver, FixedStep):
        return shoot(equilibrium, start, partial(march, steps=solver.steps), solver.steps, tolerance)
    # Imported late: diffrax is slow to import, and few rods need it.
    from rodmodel.statics._adaptive import integrate

    adaptive = partial(integrate, steps=_NODES, tolerance=tolerance)
    return shoot(equilibrium, start, adaptive, _NODES, tolerance)


@solve_equilibrium.defjvp
def _jvp(
    solver: Solver,
    primals: tuple[Equilibrium, Float[Array, " n"] | None],
    tangents: tuple[Equilibrium, Float[Array, " n"] | None],
) -> tuple[ShootingState, ShootingState]:
    reached = solve_equilibrium(*primals, solver)
    fraction = reached.load_fraction
    nodes_dot, unknown_dot = equilibrium_change(
        primals[0].scaled(fraction), tangents[0].scaled(fraction), reached.nodes, reached.unknown
    )
    no_tangent = jax.tree.map(custom_derivatives.zero_from_primal, reached)
    return reached, no_tangent._replace(unknown=unknown_dot, nodes=nodes_dot)
