"""The two solvers behind one face, and derivatives of what they find by the implicit function theorem."""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jax import custom_derivatives
from jaxtyping import Array, Bool, Float, Int

from rodmodel._balance import Equilibrium
from rodmodel._components import triple
from rodmodel._follow import CONVERGED, DIVERGED, Reached, follow, scaled
from rodmodel._kernel import one_kernel
from rodmodel._loads import Loads, resultants
from rodmodel._march import Nodes, march
from rodmodel._sensitivity import nodes_tangent
from rodmodel._shape import Arc, Shape, Stepped
from rodmodel.calibration_file import Actuator
from rodmodel.section import CurvatureLaw

# What is asked of Newton's method on u L [rad], and of one integration step with adaptive steps.
_NEWTON = {"float64": 1e-10, "float32": 1e-5}
_INTEGRATION = {"float64": 1e-10, "float32": 1e-5}

# The adaptive solver's result is given at so many equal parts of the body; derivatives are integrated over as
# many or a few more, to 1e-7 for a rod that turns by half a turn.
_NODES = 32
_FIRST_STEPS = 8


@dataclass(frozen=True)
class FixedStep:
    """The solver for control: a fixed number of steps along the rod, of order 4.

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
    tolerance : of one step, relative and absolute, on r/L, quaternion and u L; by default 1e-10, or 1e-5 in
        single precision.
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
    offset: Float[Array, "3"] | None,
    start: Float[Array, " n"] | None,
    solver: Solver,
) -> tuple[Shape, Reached]:
    """Solve for the shape of the body: without loads an arc of the free curvature, in closed form.

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
    equilibrium = Equilibrium(law, resultants(loads, actuator, free.dtype), actuator, offset)
    if not jax.tree.leaves(loads):
        return Arc(base_curvature=free, length=length), Reached.free(length * free)
    reached = solve_equilibrium(equilibrium, start, solver)
    nodes = reached.nodes
    shape = Stepped(
        positions=length * nodes.positions,
        quaternions=nodes.quaternions,
        node_curvatures=nodes.turns / length,
        length=length,
        node_drifts=_drifts(equilibrium, reached),
    )
    return shape, reached


def _drifts(equilibrium: Equilibrium, reached: Reached) -> Float[Array, "nodes 3"] | None:
    """What shear adds to r' at the nodes; None for nothing."""
    if equilibrium.shear is None:
        return None
    loaded = scaled(equilibrium, reached.load_fraction)
    follower = triple(reached.unknown[3:]) if equilibrium.unknowns == 6 else None

    def at(fraction: Float[Array, ""], q: Float[Array, "4"]) -> Float[Array, "3"]:
        return jnp.stack(loaded.drift(fraction, (q[0], q[1], q[2], q[3]), follower))

    quaternions = reached.nodes.quaternions
    fractions = jnp.linspace(0.0, 1.0, quaternions.shape[0], dtype=quaternions.dtype)
    return jax.vmap(at)(fractions, quaternions)


@partial(jax.custom_jvp, nondiff_argnums=(2,))
def solve_equilibrium(equilibrium: Equilibrium, start: Float[Array, " n"] | None, solver: Solver) -> Reached:
    """Solve with one of the solvers; see [`rodmodel._follow.follow`][].

    Derivatives are those of the equilibrium at the load fraction that was reached, not of the iterations nor
    of the steps: see [`rodmodel._sensitivity`][].
    """
    if isinstance(solver, FixedStep):
        tolerance = _of(_NEWTON, equilibrium) if solver.tolerance is None else solver.tolerance
        return _follow(equilibrium, start, solver.steps, tolerance)
    # Imported late: diffrax takes a while to import, and not every rod needs it.
    from rodmodel._adaptive import polish

    reached = _follow_closely(equilibrium, start, 1e-2 * _of(_NEWTON, equilibrium) ** 0.5)
    tolerance = _of(_INTEGRATION, equilibrium) if solver.tolerance is None else solver.tolerance
    polished, converged = polish(equilibrium, reached, _NODES, tolerance)
    fallen = (reached.outcome == CONVERGED) & ~converged
    return polished._replace(outcome=jnp.where(fallen, DIVERGED, reached.outcome))


@partial(jax.custom_jvp, nondiff_argnums=(2,))
def _solve_finely(
    equilibrium: Equilibrium, start: Float[Array, " n"] | None, solver: Solver
) -> tuple[Reached, Nodes]:
    """Solve, and give nodes that are close enough to integrate over, those of the result among them."""
    reached = solve_equilibrium(equilibrium, start, solver)
    if isinstance(solver, Adaptive):
        return reached, reached.nodes

    def run(equilibrium: Equilibrium, unknown: Float[Array, " n"]) -> Nodes:
        return march(equilibrium, unknown, solver.steps * _refinement(solver))[0]

    fine: Nodes = one_kernel(run, scaled(equilibrium, reached.load_fraction), reached.unknown)
    return reached, fine


@solve_equilibrium.defjvp
def _jvp(
    solver: Solver,
    primals: tuple[Equilibrium, Float[Array, " n"] | None],
    tangents: tuple[Equilibrium, Float[Array, " n"] | None],
) -> tuple[Reached, Reached]:
    (reached, _), (reached_dot, _) = _finely_jvp(solver, primals, tangents)
    return reached, reached_dot


@_solve_finely.defjvp
def _finely_jvp(
    solver: Solver,
    primals: tuple[Equilibrium, Float[Array, " n"] | None],
    tangents: tuple[Equilibrium, Float[Array, " n"] | None],
) -> tuple[tuple[Reached, Nodes], tuple[Reached, Nodes]]:
    reached, fine = _solve_finely(*primals, solver)
    fraction = reached.load_fraction
    fine_dot, unknown_dot = nodes_tangent(
        scaled(primals[0], fraction), scaled(tangents[0], fraction), fine, reached.unknown
    )
    nodes_dot = jax.tree.map(lambda nodes: nodes[:: _refinement(solver)], fine_dot)
    no_tangent = jax.tree.map(custom_derivatives.zero_from_primal, reached)
    return (reached, fine), (no_tangent._replace(unknown=unknown_dot, nodes=nodes_dot), fine_dot)


def _follow_closely(equilibrium: Equilibrium, start: Float[Array, " n"] | None, tolerance: float) -> Reached:
    """Solve with few fixed steps, and with many where that fails: large loads make the rod turn sharply."""

    def run(equilibrium: Equilibrium, start: Float[Array, " n"] | None, taken: Float[Array, ""]) -> Reached:
        # A kernel's arguments are all of one type.
        return _without_nodes(follow(equilibrium, start, _NODES, tolerance, taken=taken.astype(int)))

    def unfinished(at: tuple[Reached, Int[Array, ""]]) -> Bool[Array, ""]:
        return (at[1] <= _NODES) & (at[0].load_fraction < 1.0)

    def again(at: tuple[Reached, Int[Array, ""]]) -> tuple[Reached, Int[Array, ""]]:
        return one_kernel(run, equilibrium, start, at[1]), at[1] * (_NODES // _FIRST_STEPS)

    nowhere = Reached.free(jnp.zeros(equilibrium.unknowns, equilibrium.law.free_curvature.dtype))
    nowhere = nowhere._replace(load_fraction=jnp.zeros_like(nowhere.load_fraction))
    # A loop, so that both are compiled as one.
    reached: Reached = jax.lax.while_loop(unfinished, again, (nowhere, jnp.array(_FIRST_STEPS)))[0]
    return reached


def _without_nodes(reached: Reached) -> Reached:
    """Result without its nodes, which the adaptive solver does not need."""
    empty = jax.tree.map(lambda nodes: nodes[:0], reached.nodes)
    return reached._replace(nodes=empty)


def _refinement(solver: Solver) -> int:
    """Nodes to integrate over, for each step of the solver."""
    return 1 if isinstance(solver, Adaptive) else -(-_NODES // solver.steps)


def _of(tolerances: dict[str, float], equilibrium: Equilibrium) -> float:
    return tolerances[equilibrium.law.free_curvature.dtype.name]


def _follow(
    equilibrium: Equilibrium, start: Float[Array, " n"] | None, steps: int, tolerance: float
) -> Reached:
    def run(equilibrium: Equilibrium, start: Float[Array, " n"] | None) -> Reached:
        return follow(equilibrium, start, steps, tolerance)

    reached: Reached = one_kernel(run, equilibrium, start)
    return reached
