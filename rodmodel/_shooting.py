"""Rod under dead loads, by shooting: the curvature at the base for which the end is in equilibrium."""

from functools import partial
from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jax import custom_derivatives
from jaxtyping import Array, Bool, Float, Int

from rodmodel._equilibrium import Equilibrium, base_state, split
from rodmodel._nodes import INTEGRALS, NODES

_MAX_ODE_STEPS = 256
_MAX_NEWTON_STEPS = 12
_MAX_LOAD_STEPS = 64
_SMALLEST_LOAD_STEP = 2.0**-10

# A load step may turn the base by no more than this over the body [rad]: it keeps Newton on the branch of
# equilibria that the rod takes when the load grows from zero.
_MAX_TURN = 2.0


class Shot(NamedTuple):
    """Result of a solve."""

    states: Float[Array, "n 10"]
    """At the asked fractions of the body."""
    load_fraction: Float[Array, ""]
    """Of the loads, at which the states are in equilibrium; 1 where all went well."""
    load_steps: Int[Array, ""]
    ode_steps: Int[Array, ""]


@partial(jax.custom_jvp, nondiff_argnums=(1,))
def shoot(equilibrium: Equilibrium, tolerance: float) -> Shot:
    """Solve for the equilibrium that the rod reaches from its free shape as the loads grow in proportion.

    Parameters
    ----------
    equilibrium : equations and loads.
    tolerance : of one step of the integration, relative and absolute, on r/L, quaternion and u L.

    Returns
    -------
    shot : where the full load cannot be reached, the equilibrium at the largest fraction of it that was.
        Derivatives are those of the equilibrium at that fraction, by the implicit function theorem.
    """
    load_fraction, turn, load_steps = _continuation(equilibrium, tolerance)
    states, ode_steps = _integrate(_scaled(equilibrium, load_fraction), base_state(turn), tolerance)
    return Shot(states, load_fraction, load_steps, ode_steps)


@shoot.defjvp
def _shoot_jvp(
    tolerance: float, primals: tuple[Equilibrium], tangents: tuple[Equilibrium]
) -> tuple[Shot, Shot]:
    """Tangent of the states by variation of constants: reverse mode has no adaptive loop to transpose.

    With y' = f(y, θ), Y(s) = ∂y(s)/∂y(0) and g(y(1), θ) = 0 the condition at the end,

        ẏ(s) = Y(s) [u̇₀ + ∫₀ˢ Y⁻¹ f_θ θ̇ ds],   g_y ẏ(1) + g_θ θ̇ = 0

    where only the curvature of ẏ(0) = u̇₀ is free. The integral is that of the polynomial through the nodes.
    """
    (equilibrium,) = primals
    shot = shoot(equilibrium, tolerance)
    states, nodes = shot.states, jnp.asarray(NODES, shot.states.dtype)
    reached = _scaled(equilibrium, shot.load_fraction)
    reached_dot = _scaled(tangents[0], shot.load_fraction)

    def rates(equilibrium: Equilibrium) -> Float[Array, "n 10"]:
        return jax.vmap(equilibrium.rate)(nodes, states)

    by_base = jax.jacfwd(lambda base: _integrate(reached, base, tolerance)[0])(states[0])
    forcing = jax.jvp(rates, (reached,), (reached_dot,))[1]
    pulled_back = jnp.linalg.solve(by_base, forcing[:, :, None])[:, :, 0]
    under_load = jnp.einsum("nij,nj->ni", by_base, jnp.asarray(INTEGRALS, states.dtype) @ pulled_back)

    by_turn = split(by_base)[2]
    imbalance_by_turn = jax.jacfwd(reached.end_imbalance)(states[-1]) @ by_turn[-1]
    imbalance_dot = jax.jvp(
        lambda reached, end: reached.end_imbalance(end),
        (reached, states[-1]),
        (reached_dot, under_load[-1]),
    )[1]
    turn_dot = -jnp.linalg.solve(imbalance_by_turn, imbalance_dot)
    no_tangent = jax.tree.map(custom_derivatives.zero_from_primal, shot)
    return shot, no_tangent._replace(states=under_load + by_turn @ turn_dot)


class _Progress(NamedTuple):
    load_fraction: Float[Array, ""]
    turn: Float[Array, "3"]
    """u L at the base in equilibrium with that fraction of the loads."""
    slope: Float[Array, "3"]
    """Of `turn` by the load fraction, over the last load step."""
    step: Float[Array, ""]
    """Load step to try next."""
    tried: Int[Array, ""]


def _continuation(
    equilibrium: Equilibrium, tolerance: float
) -> tuple[Float[Array, ""], Float[Array, "3"], Int[Array, ""]]:
    """Fraction of the load that was reached, u L at the base there, and the load steps that it took.

    The whole load is tried first. A load step that fails is halved; one that succeeds lets the next be
    twice as long, from a start extrapolated along the last one.
    """
    newton: optx.Newton = optx.Newton(rtol=10.0 * tolerance, atol=10.0 * tolerance)

    def residual(turn: Float[Array, "3"], reached: Equilibrium) -> Float[Array, "3"]:
        return _residual(reached, turn, tolerance)

    def unfinished(at: _Progress) -> Bool[Array, ""]:
        return (at.load_fraction < 1.0) & (at.step >= _SMALLEST_LOAD_STEP) & (at.tried < _MAX_LOAD_STEPS)

    def advance(at: _Progress) -> _Progress:
        left = 1.0 - at.load_fraction
        step = jnp.minimum(at.step, left)
        target = jnp.where(at.step < left, at.load_fraction + step, 1.0)
        found: optx.Solution = optx.root_find(
            residual,
            newton,
            at.turn + at.slope * step,
            args=_scaled(equilibrium, target),
            max_steps=_MAX_NEWTON_STEPS,
            throw=False,
        )
        moved = found.value - at.turn
        good = (found.result == optx.RESULTS.successful) & (jnp.max(jnp.abs(moved)) <= _MAX_TURN)
        return _Progress(
            load_fraction=jnp.where(good, target, at.load_fraction),
            turn=jnp.where(good, found.value, at.turn),
            slope=jnp.where(good, moved / step, at.slope),
            step=jnp.where(good, 2.0, 0.5) * step,
            tried=at.tried + 1,
        )

    free = equilibrium.law.free_curvature * equilibrium.actuator.body_length
    one = jnp.ones_like(free[0])
    start = _Progress(jnp.zeros_like(one), free, jnp.zeros_like(free), one, jnp.zeros((), int))
    end = jax.lax.while_loop(unfinished, advance, start)
    return end.load_fraction, end.turn, end.tried


def _residual(equilibrium: Equilibrium, turn: Float[Array, "3"], tolerance: float) -> Float[Array, "3"]:
    """Imbalance at the end for a curvature u L = `turn` at the base, as the turn that it causes [rad]."""
    law, length = equilibrium.law, equilibrium.actuator.body_length
    end = _integrate(equilibrium, base_state(turn), tolerance, diffrax.SaveAt(t1=True))[0][-1]
    stiffness = jnp.trace(law.stiffness(law.free_curvature)) / 3.0
    return equilibrium.end_imbalance(end) * (length / stiffness)


def _integrate(
    equilibrium: Equilibrium,
    base: Float[Array, "10"],
    tolerance: float,
    saveat: diffrax.SaveAt | None = None,
) -> tuple[Float[Array, "n 10"], Int[Array, ""]]:
    """Integrate from the state at the base to the end of the body.

    Returns
    -------
    states : where `saveat` asks, else at the nodes.
    steps : that were accepted.
    """
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(lambda fraction, state, equilibrium: equilibrium.rate(fraction, state)),
        diffrax.Dopri8(),
        t0=0.0,
        t1=1.0,
        dt0=0.1,
        y0=base,
        args=equilibrium,
        saveat=diffrax.SaveAt(ts=jnp.asarray(NODES, base.dtype)) if saveat is None else saveat,
        stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
        adjoint=diffrax.ForwardMode(),
        max_steps=_MAX_ODE_STEPS,
        throw=False,
    )
    states: Any = solution.ys
    return states, solution.stats["num_accepted_steps"]


def _scaled(equilibrium: Equilibrium, fraction: Float[Array, ""]) -> Equilibrium:
    """Equilibrium under a fraction of the loads."""
    loads = jax.tree.map(lambda load: fraction * load, equilibrium.loads)
    return eqx.tree_at(lambda e: e.loads, equilibrium, loads)
