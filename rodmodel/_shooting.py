"""Rod under dead loads, by shooting: the curvature at the base for which the end is in equilibrium."""

from functools import partial
from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import custom_derivatives
from jaxtyping import Array, Bool, Float, Int

from rodmodel._equilibrium import Equilibrium, base_state, solve_3x3, split
from rodmodel._nodes import INTEGRALS, NODES
from rodmodel._stability import is_stable

_MAX_ODE_STEPS = 256
_MAX_SHOTS = 512
_SMALLEST_LOAD_STEP = 2.0**-16

# What keeps the rod on the branch of equilibria that it takes as the load grows from zero: in a load step,
# no r/L and no part of the quaternion changes by more than the first of these, no u L by more than the second
# [rad], and no correction of Newton's method is more than the third of the one before (Deuflhard 2011, Newton
# Methods for Nonlinear Problems, ch. 5). Without them a long load step may end in another one, a coil.
_MAX_MOVE = 0.5
_MAX_TURN = 1.0
_CONTRACTION = 0.5


class Shot(NamedTuple):
    """Result of a solve."""

    states: Float[Array, "n 10"]
    """At the nodes."""
    load_fraction: Float[Array, ""]
    """Of the loads, at which the states are in equilibrium; 1 where all went well."""
    load_steps: Int[Array, ""]
    """From the free shape to there."""
    shots: Int[Array, ""]
    """Integrations from base to end."""


class _Progress(NamedTuple):
    reached: Shot
    turn: Float[Array, "3"]
    """u L at the base in the equilibrium that was reached."""
    slope: Float[Array, "3"]
    """Of `turn` by the load fraction, over the last load step."""
    step: Float[Array, ""]
    """Load step that is being tried."""
    guess: Float[Array, "3"]
    """u L at the base that Newton's method tries next."""
    correction: Float[Array, ""]
    """Size of the last correction to it; infinite for a first guess."""


@partial(jax.custom_jvp, nondiff_argnums=(1,))
def shoot(equilibrium: Equilibrium, tolerance: float) -> Shot:
    """Solve for the equilibrium that the rod reaches from its free shape as the loads grow in proportion.

    The unknown is u L at the base, and Newton's method finds it. After the free shape, the whole load is
    tried; a load step that fails is halved, one that succeeds lets the next be twice as long, from a start
    extrapolated along the last one. Each turn of the loop is one shot.

    Parameters
    ----------
    equilibrium : equations and loads.
    tolerance : of one step of the integration, relative and absolute, on r/L, quaternion and u L.

    Returns
    -------
    shot : where the full load cannot be reached, because the rod would buckle or snap on the way or the steps
        become too small, the equilibrium at the largest fraction of it that was. Derivatives are those of
        the equilibrium at that fraction, by the implicit function theorem.
    """

    def shot_from(turn: Float[Array, "3"], loaded: Equilibrium) -> tuple[tuple[Array, Array], ...]:
        states = _integrate(loaded, base_state(turn), tolerance)
        result = states, loaded.end_imbalance(states[-1])
        return result, result

    def unfinished(at: _Progress) -> Bool[Array, ""]:
        possible = (at.step >= _SMALLEST_LOAD_STEP) & (at.reached.shots < _MAX_SHOTS)
        return (at.reached.load_fraction < 1.0) & possible

    def advance(at: _Progress) -> _Progress:
        reached = at.reached
        unloaded = reached.load_steps == 0
        left = 1.0 - reached.load_fraction
        target = jnp.where(at.step < left, reached.load_fraction + at.step, 1.0)
        target = jnp.where(unloaded, 0.0, target)
        loaded = _scaled(equilibrium, target)
        by_turn, (states, imbalance) = jax.jacfwd(shot_from, has_aux=True)(at.guess, loaded)
        correction = -solve_3x3(by_turn[1], imbalance)
        size = jnp.max(jnp.abs(correction))

        done = size <= 10.0 * tolerance
        follows = _near(states, reached.states) & is_stable(loaded, states, *by_turn)
        good = done & (unloaded | follows)
        # Written so that a NaN is hopeless.
        hopeful = ~done & (size <= _CONTRACTION * at.correction) & (size <= _MAX_TURN)

        turn = jnp.where(good, at.guess, at.turn)
        slope = jnp.where(good & ~unloaded, (at.guess - at.turn) / at.step, at.slope)
        factor = jnp.where(good & ~unloaded, 2.0, jnp.where(good | hopeful, 1.0, 0.5))
        step = jnp.minimum(factor * at.step, 1.0 - jnp.where(good, target, reached.load_fraction))
        return _Progress(
            reached=Shot(
                states=jnp.where(good, states, reached.states),
                load_fraction=jnp.where(good, target, reached.load_fraction),
                load_steps=reached.load_steps + good,
                shots=reached.shots + 1,
            ),
            turn=turn,
            slope=slope,
            step=step,
            guess=jnp.where(hopeful, at.guess + correction, turn + step * slope),
            correction=jnp.where(hopeful, size, jnp.inf),
        )

    free = equilibrium.law.free_curvature * equilibrium.actuator.body_length
    one, none = jnp.ones_like(free[0]), jnp.zeros((), int)
    nowhere = Shot(jnp.full((NODES.size, 10), jnp.nan, free.dtype), 0.0 * one, none, none)
    start = _Progress(nowhere, free, jnp.zeros_like(free), one, free, jnp.inf * one)
    end = jax.lax.while_loop(unfinished, advance, start).reached
    # The step to the free shape is none.
    return end._replace(load_steps=jnp.maximum(end.load_steps - 1, 0))


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

    by_base = jax.jacfwd(lambda base: _integrate(reached, base, tolerance))(states[0])
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
    turn_dot = -solve_3x3(imbalance_by_turn, imbalance_dot)
    no_tangent = jax.tree.map(custom_derivatives.zero_from_primal, shot)
    return shot, no_tangent._replace(states=under_load + by_turn @ turn_dot)


def _near(states: Float[Array, "n 10"], others: Float[Array, "n 10"]) -> Bool[Array, ""]:
    """Whether two shapes are as close as two neighbours on one branch must be."""
    change = jnp.max(jnp.abs(states - others), axis=0)
    return jnp.all(change[:7] <= _MAX_MOVE) & jnp.all(change[7:] <= _MAX_TURN)


def _integrate(equilibrium: Equilibrium, base: Float[Array, "10"], tolerance: float) -> Float[Array, "n 10"]:
    """Integrate from the state at the base to the end of the body; the states at the nodes."""
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(lambda fraction, state, equilibrium: equilibrium.rate(fraction, state)),
        diffrax.Dopri8(),
        t0=0.0,
        t1=1.0,
        dt0=0.1,
        y0=base,
        args=equilibrium,
        saveat=diffrax.SaveAt(ts=jnp.asarray(NODES, base.dtype)),
        stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
        adjoint=diffrax.ForwardMode(),
        max_steps=_MAX_ODE_STEPS,
        throw=False,
    )
    states: Any = solution.ys
    return states


def _scaled(equilibrium: Equilibrium, fraction: Float[Array, ""]) -> Equilibrium:
    """Equilibrium under a fraction of the loads."""
    loads = jax.tree.map(lambda load: fraction * load, equilibrium.loads)
    return eqx.tree_at(lambda e: e.loads, equilibrium, loads)
