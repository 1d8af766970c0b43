"""Runge-Kutta-Munthe-Kaas methods on SE(3), for the frame of a rod, from the methods of diffrax."""

from collections.abc import Callable
from typing import Any, ClassVar, final

import diffrax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel.kinematics import cross_matrix, screw
from rodmodel.statics._equilibrium import State

# Series of the inverse differential of exp in ad_Θ⁰, ad_Θ¹, …: Bernoulli numbers over factorials, to order 8.
_DEXPINV = (1.0, 0.5, 1.0 / 12.0, 0.0, -1.0 / 720.0, 0.0, 1.0 / 30240.0)


@final
class MuntheKaas(diffrax.AbstractSolver):
    """Runge-Kutta method in the logarithm of the motion since the start of the step.

    The state is a `State`, and the vector field gives its rate (v, ω̂, u') in the frame: r' = R v, R' = R ω̂.
    In a step, with (r, R) = (r₀, R₀) exp Θ,

        Θ' = a + ½ [Θ, a] + (1/12) [Θ, [Θ, a]] − …,   a = (v, ω)

    which the given method solves from Θ = 0 along with u. For constant a, Θ is linear: one step is exact for
    a rod of constant curvature, whatever its length. Error estimate and dense output are those of the method,
    in Θ and u.

    Attributes
    ----------
    method : any explicit Runge-Kutta method of order 8 or less.

    References
    ----------
    Munthe-Kaas (1998), BIT 38, 92. Brackets have the opposite sign here, as the frame is multiplied from the
    right.
    """

    method: diffrax.AbstractERK = diffrax.Dopri8()

    term_structure: ClassVar = diffrax.AbstractTerm

    @property
    def interpolation_cls(self) -> Callable[..., "_Dense"]:  # type: ignore[override]
        """Constructor of the dense output."""
        return lambda *, t0, t1, base, inner: _Dense(
            t0, t1, base, self.method.interpolation_cls(t0=t0, t1=t1, **inner)
        )

    def order(self, terms: Any) -> int | None:
        """Order of the method."""
        return self.method.order(terms)

    def init(self, terms: Any, t0: Any, t1: Any, y0: State, args: Any) -> None:
        """Return no state: every step has its own chart."""
        del terms, t0, t1, y0, args

    def step(
        self, terms: Any, t0: Any, t1: Any, y0: State, args: Any, solver_state: None, made_jump: Any
    ) -> tuple[State, State, dict[str, Any], None, diffrax.RESULTS]:
        """Take one step."""
        del solver_state, made_jump

        def rate(t: Any, z: Array, args: Any) -> Array:
            body: State = terms.vf(t, _from_chart(y0, z), args)
            motion = jnp.stack([body.rotation[2, 1], body.rotation[0, 2], body.rotation[1, 0]])
            return jnp.concatenate([*_dexpinv(z[:3], z[3:6], body.position, motion), body.turn])

        chart = diffrax.ODETerm(rate)
        start = jnp.concatenate([jnp.zeros(6, y0.turn.dtype), y0.turn])
        state = self.method.init(chart, t0, t1, start, args)
        end, error, inner, _, result = self.method.step(chart, t0, t1, start, args, state, jnp.array(True))
        estimate = State(error[:3], cross_matrix(error[3:6]), error[6:])
        return _from_chart(y0, end), estimate, {"base": y0, "inner": inner}, None, result

    def func(self, terms: Any, t0: Any, y0: State, args: Any) -> State:
        """Evaluate the vector field."""
        rate: State = terms.vf(t0, y0, args)
        return rate


class _Dense(diffrax.AbstractLocalInterpolation):
    t0: Any  # type: ignore[misc]
    t1: Any  # type: ignore[misc]
    base: State
    inner: diffrax.AbstractLocalInterpolation

    def evaluate(self, t0: Any, t1: Any | None = None, left: bool = True) -> State:
        if t1 is not None:
            raise NotImplementedError("the difference of two frames is no frame")
        return _from_chart(self.base, self.inner.evaluate(t0, None, left))


def _from_chart(base: State, z: Float[Array, "9"]) -> State:
    """Return the state of a logarithm Θ and u."""
    shift, rotation = screw(z[3:6], z[:3])
    return State(base.position + base.rotation @ shift, base.rotation @ rotation, z[6:])


def _dexpinv(
    v: Float[Array, "3"], w: Float[Array, "3"], shift: Float[Array, "3"], turn: Float[Array, "3"]
) -> tuple[Array, Array]:
    """Return Θ' of a motion (shift, turn), with Θ = (v, w)."""
    shifts, turns = shift, turn
    for factor in _DEXPINV[1:]:
        shift, turn = jnp.cross(w, shift) + jnp.cross(v, turn), jnp.cross(w, turn)
        shifts, turns = shifts + factor * shift, turns + factor * turn
    return shifts, turns
