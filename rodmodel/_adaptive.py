"""Shooting with adaptive steps: the reference, started where the fixed steps ended."""

from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from rodmodel._balance import Equilibrium, State
from rodmodel._components import into_body, triple
from rodmodel._follow import Reached, scaled, shooting_jacobian
from rodmodel._kernel import one_kernel
from rodmodel._lie_solver import MuntheKaas
from rodmodel._march import Nodes
from rodmodel._small_systems import eliminate

_MAX_ODE_STEPS = 256
_MAX_SHOTS = 8


class _Polish(NamedTuple):
    unknown: Float[Array, " n"]
    nodes: Nodes
    size: Float[Array, ""]
    shots: Int[Array, ""]
    improving: Bool[Array, ""]


def polish(equilibrium: Equilibrium, reached: Reached, nodes: int, tolerance: float) -> tuple[Reached, Array]:
    """Correct an equilibrium of the fixed steps, by Newton's method with the Jacobian of fine ones.

    Parameters
    ----------
    equilibrium : equations and loads.
    reached : by the fixed steps.
    nodes : how many steps of equal size the result has; those of the integration are its own.
    tolerance : of one step of the integration, relative and absolute, on r/L, quaternion and u L.

    Returns
    -------
    reached : with nodes and unknown corrected. Where the integration ran out of steps, they are those of as
        many fixed steps from the unknown that came.
    converged : whether the last correction was within the tolerance.
    """
    loaded = scaled(equilibrium, reached.load_fraction)

    def jacobian_of(
        equilibrium: Equilibrium, unknown: Float[Array, " n"], scale: Float[Array, " n"]
    ) -> tuple[Array, Nodes]:
        return shooting_jacobian(equilibrium, unknown, nodes, scale)

    def integrated(equilibrium: Equilibrium, unknown: Float[Array, " n"]) -> tuple[Nodes, Array]:
        return integrate(equilibrium, unknown, nodes, tolerance)

    # Once: the fixed steps ended so near that each correction is a thousandth of the last, if not less.
    jacobian, stepped = one_kernel(jacobian_of, loaded, reached.unknown, reached.scale)

    def unfinished(at: _Polish) -> Bool[Array, ""]:
        return (at.size > tolerance) & (at.shots < _MAX_SHOTS) & at.improving

    def advance(at: _Polish) -> _Polish:
        found, imbalance = one_kernel(integrated, loaded, at.unknown)
        correction = reached.scale * eliminate(jacobian, imbalance)[0]
        size = jnp.max(jnp.abs(correction / reached.scale))
        done = size <= tolerance
        improving = done | (size <= 0.5 * at.size)
        unknown = jnp.where(improving & ~done, at.unknown - correction, at.unknown)
        return _Polish(unknown, found, size, at.shots + 1, improving)

    dtype = reached.unknown.dtype
    begin = _Polish(
        reached.unknown,
        Nodes.room(nodes, dtype),
        jnp.full((), jnp.inf, dtype),
        jnp.zeros((), int),
        jnp.array(True),
    )
    end = jax.lax.while_loop(unfinished, advance, begin)

    found = jnp.all(jnp.isfinite(end.nodes.positions))
    unknown = jnp.where(found, end.unknown, reached.unknown)
    kept: Nodes = jax.tree.map(lambda a, b: jnp.where(found, a, b), end.nodes, stepped)
    shots = reached.shots + end.shots
    return reached._replace(unknown=unknown, nodes=kept, shots=shots), end.size <= tolerance


def integrate(
    equilibrium: Equilibrium, unknown: Float[Array, " n"], nodes: int, tolerance: float
) -> tuple[Nodes, Float[Array, " n"]]:
    """Integrate from base to end.

    Returns
    -------
    nodes : `nodes` + 1 sections, equally spaced.
    imbalance : at the end.
    """
    follower = triple(unknown[3:]) if equilibrium.unknowns == 6 else None
    straight = jnp.array([0.0, 0.0, 1.0, 0.0], unknown.dtype)

    def rate(fraction: Any, state: Array, equilibrium: Equilibrium) -> Array:
        quaternion, turn = state[3:7], triple(state[7:])
        w, x, y, z = quaternion
        here = State((w, x, y, z), turn)
        fraction = jnp.asarray(fraction, state.dtype)
        ahead = straight
        if equilibrium.shear is not None:
            x, y, _ = into_body(here.quaternion, equilibrium.drift(fraction, here.quaternion, follower))
            ahead = jnp.stack([x, y, *straight[2:]])
        return jnp.concatenate([ahead, state[7:], jnp.stack(equilibrium.turn_rate(fraction, here, follower))])

    base = jnp.asarray([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], unknown.dtype)
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(rate),
        MuntheKaas(),
        t0=0.0,
        t1=1.0,
        dt0=0.25,
        y0=jnp.concatenate([base, unknown[:3]]),
        args=equilibrium,
        saveat=diffrax.SaveAt(ts=jnp.asarray(np.arange(nodes + 1) / nodes, unknown.dtype)),
        stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
        adjoint=diffrax.ForwardMode(),
        max_steps=_MAX_ODE_STEPS,
        throw=False,
    )
    states: Any = solution.ys
    w, x, y, z = states[-1, 3:7]
    end = State((w, x, y, z), triple(states[-1, 7:]))
    imbalance = jnp.concatenate([jnp.stack(part) for part in equilibrium.end_imbalance(end, follower)])
    return Nodes(states[:, :3], states[:, 3:7], states[:, 7:]), imbalance
