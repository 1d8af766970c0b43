"""Fixed steps along the rod: a Munthe-Kaas method of order 4, exact for constant curvature."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from rodmodel.kinematics import rotation_of, screw
from rodmodel.statics._equilibrium import Equilibrium, State

# Difference of orders 2 and 4 within a step [rad] above which steps are too few, and how much longer than the
# rod the way to a section may come out.
_ROUGHNESS = 0.5
STRETCH = 1.02


def step(
    equilibrium: Equilibrium,
    fraction: Float[Array, ""],
    h: float,
    state: State,
    unknown: Float[Array, " n"],
) -> tuple[State, Float[Array, ""]]:
    """One step along the rod.

    With k₁ … k₄ the values of u L at the stages of the classical Runge-Kutta method of order 4 and h the
    step's part of the length, the frames at the stages are R, R exp(h k₁/2), R exp(h k₂/2 + h² [k₁, k₂]/8)
    and R exp(h k₃), and that at the end R exp(Ω) with

        Ω = h (k₁ + 2 k₂ + 2 k₃ + k₄)/6 + h² [k₁, k₄]/12

    in se(3), brackets of the pair (e₃, u L). Where all k are equal, the step is the screw of that curvature.
    What shear adds to the position is summed over the stages with the same weights.

    Parameters
    ----------
    equilibrium : equations.
    fraction : s/L where the step starts.
    h : the step's part of the body's length.
    state : at the start.
    unknown : of the equilibrium.

    Returns
    -------
    state : at the end.
    roughness : difference of the step's ends by orders 2 and 4, of u L [rad].

    References
    ----------
    Munthe-Kaas and Owren (1999), Phil. Trans. R. Soc. A 357, 957, sec. 4. Brackets turn their sign, as the
    frame is multiplied from the right here.
    """
    r, R, k1 = state

    def stage(c: float, turn: Float[Array, "3"], k: Float[Array, "3"]) -> tuple[Array, Array]:
        """Rate of u L, and what shear adds to r', at a part c of the step."""
        s, here = fraction + c * h, State(r, R @ rotation_of(turn), k)
        return equilibrium.turn_rate(s, here, unknown), here.rotation @ equilibrium.lean(s, here, unknown)

    rate1, lean1 = stage(0.0, jnp.zeros_like(k1), k1)
    k2 = k1 + 0.5 * h * rate1
    rate2, lean2 = stage(0.5, 0.5 * h * k1, k2)
    k3 = k1 + 0.5 * h * rate2
    rate3, lean3 = stage(0.5, 0.5 * h * k2 + h**2 / 8.0 * jnp.cross(k1, k2), k3)
    k4 = k1 + h * rate3
    rate4, lean4 = stage(1.0, h * k3, k4)

    axis = jnp.array([0.0, 0.0, 1.0], k1.dtype)
    turn = h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4) + h**2 / 12.0 * jnp.cross(k1, k4)
    shift, rotation = screw(turn, h * axis + h**2 / 12.0 * jnp.cross(k1 - k4, axis))
    leaning = h / 6.0 * (lean1 + 2.0 * lean2 + 2.0 * lean3 + lean4)
    k = k1 + h / 6.0 * (rate1 + 2.0 * rate2 + 2.0 * rate3 + rate4)
    return State(r + R @ shift + leaning, R @ rotation, k), jnp.max(jnp.abs(k - k4))


def march(equilibrium: Equilibrium, unknown: Float[Array, " n"], steps: int) -> tuple[State, Bool[Array, ""]]:
    """Integrate from base to end.

    Returns
    -------
    nodes : `steps` + 1 sections.
    resolved : whether the steps are short enough for how sharply the rod turns.
    """
    h = 1.0 / steps

    def along(state: State, fraction: Float[Array, ""]) -> tuple[State, tuple[State, Array]]:
        after, roughness = step(equilibrium, fraction, h, state, unknown)
        return after, (after, roughness)

    base = equilibrium.base(unknown)
    _, (states, roughness) = jax.lax.scan(along, base, h * jnp.arange(steps, dtype=unknown.dtype))
    nodes = jax.tree.map(lambda first, others: jnp.concatenate([first[None], others]), base, states)
    return nodes, jnp.all(roughness <= _ROUGHNESS) & no_longer_than_the_rod(nodes)


def no_longer_than_the_rod(nodes: State) -> Bool[Array, ""]:
    """Whether no section is farther from the base than the rod is long up to it."""
    parts = jnp.linspace(0.0, 1.0, nodes.position.shape[0], dtype=nodes.position.dtype)
    return jnp.all(jnp.linalg.norm(nodes.position, axis=1) <= STRETCH * parts)
