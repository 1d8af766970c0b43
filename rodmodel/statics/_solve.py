"""The two solvers behind one face, and derivatives of what they find by the implicit function theorem."""

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
from rodmodel.statics._shooting import ARRIVED, Reached, shoot
from rodmodel.statics._stability import is_positive
from rodmodel.statics._steps import march

# What is asked of Newton's method on u L [rad], and of one integration step with adaptive steps.
_TOLERANCE = {"float64": 1e-10, "float32": 1e-5}

# The adaptive solver's result is given at so many equal parts of the body.
_NODES = 64


@dataclass(frozen=True)
class FixedStep:
    """A fixed number of steps along the rod, of order 4: those of the compiled core.

    Attributes
    ----------
    steps : along the rod. The error at the tip falls with the fourth power of their number.
    tolerance : of Newton's method on u L at the base [rad]; by default 1e-10, or 1e-5 in single precision.
    """

    steps: int = 8
    tolerance: float | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be integrated."""
        if self.steps < 1:
            raise ValueError(f"steps: got {self.steps}, expected 1 or more")
        _check_tolerance(self.tolerance)


@dataclass(frozen=True)
class Adaptive:
    """The reference solver: as many steps along the rod, of order 8, as a tolerance takes.

    Attributes
    ----------
    tolerance : of one step, relative and absolute, on r/L, R and u L, and of Newton's method on u L at the
        base [rad]; by default 1e-10, or 1e-5 in single precision.
    """

    tolerance: float | None = None

    def __post_init__(self) -> None:
        """Refuse what is no tolerance."""
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
) -> tuple[Shape, Reached, Float[Array, "3"] | None]:
    """Solve for the shape of the body: without loads an arc of the free curvature, in closed form.

    Besides the shape and how it was reached comes the force on the cap [N], in its frame; None without loads.

    Parameters
    ----------
    law : at the pressures.
    loads : in the frame of the first section.
    actuator : lengths and masses.
    offset : how far the cap lies beside the body's end, in its frame [m].
    start : unknown to start from.
    solver : for a rod with loads.
    """
    free, length = law.free_curvature, actuator.bending_length
    if not jax.tree.leaves(loads):
        none, one = jnp.zeros((), int), jnp.ones((), free.dtype)
        empty = State(jnp.zeros((0, 3)), jnp.zeros((0, 3, 3)), jnp.zeros((0, 3)))
        stable = is_positive(law.stiffness(free))
        arrived = Reached(length * free, empty, one, none, none, stable, none + ARRIVED)
        return Arc(base_curvature=free, length=length), arrived, None
    equilibrium = Equilibrium(law, resultants(loads, actuator, free.dtype), actuator, offset)
    reached = solve_equilibrium(equilibrium, start, solver)
    loaded, nodes, unknown = equilibrium.scaled(reached.load_fraction), reached.nodes, reached.unknown

    def beside(s: Float[Array, ""], R: Float[Array, "3 3"], turn: Float[Array, "3"]) -> tuple[Array, Array]:
        """Slope of u L, and what shear adds to r', at a node."""
        force = R.T @ loaded.force(s, unknown)
        lean = R @ (loaded.direction(force) - jnp.array([0.0, 0.0, 1.0], turn.dtype))
        return loaded.turn_rate(force, turn), lean

    fractions = jnp.linspace(0.0, 1.0, nodes.turn.shape[0], dtype=free.dtype)
    rates, leans = jax.vmap(beside)(fractions, nodes.rotation, nodes.turn)
    shape = Stepped(
        positions=length * nodes.position,
        rotations=nodes.rotation,
        node_curvatures=nodes.turn / length,
        node_slopes=rates / length**2,
        node_drifts=leans,
        length=length,
    )
    return shape, reached, loaded.push(nodes.rotation[-1], unknown)


@partial(jax.custom_jvp, nondiff_argnums=(2,))
def solve_equilibrium(equilibrium: Equilibrium, start: Float[Array, " n"] | None, solver: Solver) -> Reached:
    """Solve with one of the solvers; see `shoot`.

    Derivatives are those of the equilibrium at the load fraction that was reached, not of the iterations.
    """
    tolerance = solver.tolerance or _TOLERANCE[equilibrium.law.free_curvature.dtype.name]
    if isinstance(solver, FixedStep):
        return shoot(equilibrium, start, partial(march, steps=solver.steps), solver.steps, tolerance)
    # Imported late: diffrax takes a while to import, and not every rod needs it.
    from rodmodel.statics._adaptive import integrate

    adaptive = partial(integrate, steps=_NODES, tolerance=tolerance)
    return shoot(equilibrium, start, adaptive, _NODES, tolerance)


@solve_equilibrium.defjvp
def _jvp(
    solver: Solver,
    primals: tuple[Equilibrium, Float[Array, " n"] | None],
    tangents: tuple[Equilibrium, Float[Array, " n"] | None],
) -> tuple[Reached, Reached]:
    reached = solve_equilibrium(*primals, solver)
    fraction = reached.load_fraction
    nodes_dot, unknown_dot = equilibrium_change(
        primals[0].scaled(fraction), tangents[0].scaled(fraction), reached.nodes, reached.unknown
    )
    no_tangent = jax.tree.map(custom_derivatives.zero_from_primal, reached)
    return reached, no_tangent._replace(unknown=unknown_dot, nodes=nodes_dot)
