"""A Runge-Kutta method of diffrax made one of Munthe-Kaas: for the frame of a rod it steps on SE(3)."""

from collections.abc import Callable
from typing import Any, ClassVar, final

import diffrax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rodmodel._components import screw_by

# Of ad_Θ⁰, ad_Θ¹, ad_Θ², …: Bernoulli numbers over factorials, enough for order 8.
_DEXPINV = (1.0, 0.5, 1.0 / 12.0, 0.0, -1.0 / 720.0, 0.0, 1.0 / 30240.0)


@final
class MuntheKaas(diffrax.AbstractSolver):
    """Runge-Kutta method in the logarithm of the motion since the start of the step.

    The state is (r, q, u): position, quaternion of the frame R, scalar first, and three more numbers. The
    vector field gives its rate as (v, (0, ω), u'), v and ω in the frame: r' = R v, R' = R ω̂. In a step, with
    (r, R) = (r₀, R₀) exp Θ,

        Θ' = a + ½ [Θ, a] + (1/12) [Θ, [Θ, a]] − …,   a = (v, ω)

    which the given method solves from Θ = 0 along with u. Where a is constant Θ is linear, so that a rod of
    constant curvature is exact in one step, whatever its length. Error estimate and dense output are those
    of the method, in Θ and u.

    Attributes
    ----------
    method : any explicit Runge-Kutta method of order 8 or less.

    References
    ----------
    Munthe-Kaas (1998), BIT 38, 92; brackets have the sign of a frame that is multiplied from the right.
    """

    method: diffrax.AbstractERK = diffrax.Dopri8()

    term_structure: ClassVar = diffrax.AbstractTerm

    @property
    def interpolation_cls(self) -> Callable[..., "_Dense"]:  # type: ignore[override]
        """Dense output."""
        return lambda *, t0, t1, base, inner: _Dense(
            t0, t1, base, self.method.interpolation_cls(t0=t0, t1=t1, **inner)
        )

    def order(self, terms: Any) -> int | None:
        """Order of the method."""
        return self.method.order(terms)

    def init(self, terms: Any, t0: Any, t1: Any, y0: Array, args: Any) -> None:
        """Nothing is carried from step to step: each has a chart of its own."""
        del terms, t0, t1, y0, args

    def step(
        self, terms: Any, t0: Any, t1: Any, y0: Array, args: Any, solver_state: None, made_jump: Any
    ) -> tuple[Array, Array, dict[str, Any], None, diffrax.RESULTS]:
        """One step."""
        del solver_state, made_jump

        def rate(t: Any, z: Array, args: Any) -> Array:
            body = terms.vf(t, _from_chart(y0, z), args)
            motion = jnp.concatenate([body[:3], body[4:7]])
            return jnp.concatenate([_dexpinv(z[:6], motion), body[7:]])

        chart = diffrax.ODETerm(rate)
        start = jnp.concatenate([jnp.zeros(6, y0.dtype), y0[7:]])
        state = self.method.init(chart, t0, t1, start, args)
        end, error, inner, _, result = self.method.step(chart, t0, t1, start, args, state, jnp.array(True))
        error = jnp.concatenate([error[:3], jnp.zeros(1, y0.dtype), error[3:]])
        return _from_chart(y0, end), error, {"base": y0, "inner": inner}, None, result

    def func(self, terms: Any, t0: Any, y0: Array, args: Any) -> Array:
        """Vector field."""
        return terms.vf(t0, y0, args)


class _Dense(diffrax.AbstractLocalInterpolation):
    t0: Any  # type: ignore[misc]
    t1: Any  # type: ignore[misc]
    base: Float[Array, " n"]
    inner: diffrax.AbstractLocalInterpolation

    def evaluate(self, t0: Any, t1: Any | None = None, left: bool = True) -> Array:
        if t1 is not None:
            return self.evaluate(t1) - self.evaluate(t0)
        return _from_chart(self.base, self.inner.evaluate(t0, None, left))


def _from_chart(base: Float[Array, " n"], z: Float[Array, " m"]) -> Float[Array, " n"]:
    """State of a logarithm Θ and of u."""
    q, shift = screw_by(tuple(base[3:7]), tuple(z[3:6]), tuple(z[:3]))
    return jnp.concatenate([base[:3] + jnp.stack(shift), jnp.stack(q), z[6:]])


def _dexpinv(theta: Float[Array, "6"], motion: Float[Array, "6"]) -> Float[Array, "6"]:
    total = motion
    for factor in _DEXPINV[1:]:
        v, w = theta[:3], theta[3:]
        motion = jnp.concatenate(
            [jnp.cross(w, motion[:3]) + jnp.cross(v, motion[3:]), jnp.cross(w, motion[3:])]
        )
        if factor != 0.0:
            total = total + factor * motion
    return total
