"""Integration along the rod by adaptive steps of order 8: the reference."""

from typing import Any

import diffrax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from rodmodel.kinematics import cross_matrix
from rodmodel.statics._equilibrium import Equilibrium, State
from rodmodel.statics._munthe_kaas import MuntheKaas
from rodmodel.statics._steps import no_longer_than_the_rod

_MAX_STEPS = 256


def integrate(
    equilibrium: Equilibrium, unknown: Float[Array, " n"], steps: int, tolerance: float
) -> tuple[State, Bool[Array, ""]]:
    """Integrate from base to end.

    Parameters
    ----------
    equilibrium : equations of the rod.
    unknown : unknowns of the equilibrium, (n,).
    steps : number of equal parts between the returned sections; the integration chooses its own steps.
    tolerance : tolerance of one step, relative and absolute, on r/L, R and u L.

    Returns
    -------
    nodes : `steps` + 1 sections, equally spaced.
    resolved : whether 256 steps kept the tolerance.
    """

    def rate(fraction: Any, state: State, equilibrium: Equilibrium) -> State:
        """Return the rates by s/L, in the section's frame."""
        force = state.rotation.T @ equilibrium.force(jnp.asarray(fraction, unknown.dtype), unknown)
        turning = equilibrium.turn_rate(force, state.turn)
        return State(equilibrium.direction(force), cross_matrix(state.turn), turning)

    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(rate),
        MuntheKaas(),
        t0=0.0,
        t1=1.0,
        dt0=0.25,
        y0=equilibrium.base(unknown),
        args=equilibrium,
        saveat=diffrax.SaveAt(ts=jnp.linspace(0.0, 1.0, steps + 1, dtype=unknown.dtype)),
        stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
        adjoint=diffrax.ForwardMode(),
        max_steps=_MAX_STEPS,
        throw=False,
    )
    nodes: Any = solution.ys
    successful = solution.result == diffrax.RESULTS.successful
    return nodes, successful & no_longer_than_the_rod(nodes)
