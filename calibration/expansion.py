"""Value, gradient and Hessian of a free-state expansion in closed form, for all states at once.

Nested automatic differentiation gives the same numbers (a test holds the two together) but is slower, and a
fit evaluates them thousands of times. Derivatives by pressure run forward through the network, values, first
and second derivatives side by side; those by curvature are those of monomials.
"""

import itertools
import math

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float, Int

from rodmodel import FreeStateExpansion

_MONOMIALS = [
    index for order in (2, 3, 4) for index in itertools.combinations_with_replacement(range(3), order)
]
_EXPONENTS = np.array([[index.count(axis) for axis in range(3)] for index in _MONOMIALS])
# A symmetric tensor's independent entry stands for all the permutations of its indices; K carries a factor ½.
_MULTIPLICITY = np.array(
    [
        (0.5 if len(index) == 2 else 1.0)
        * math.factorial(len(index))
        / math.prod(map(math.factorial, exponents))
        for index, exponents in zip(_MONOMIALS, _EXPONENTS, strict=True)
    ]
)
_SECOND = [(i, j) for i in range(3) for j in range(i, 3)]  # the six second derivatives by pressure
_SYMMETRIC = np.array([[_SECOND.index((min(i, j), max(i, j))) for j in range(3)] for i in range(3)])

# The mirror y → −y: chambers 2 and 3 change places, curvature about x and twist change sign.
_SWAP = np.array([0, 2, 1])
_SWAP_SECOND = np.array([_SYMMETRIC[_SWAP[i], _SWAP[j]] for i, j in _SECOND])
_PARITY = np.array([1.0, -1.0, 1.0, -1.0, *((-1.0) ** (_EXPONENTS[:, 0] + _EXPONENTS[:, 2]))])

Jet = tuple[Array, Array, Array]  # value (n, k), first (3, n, k), second (6, n, k) derivatives by pressure


def derivatives(
    law: FreeStateExpansion, curvature: Float[Array, "n 3"], pressure: Float[Array, "n 3"]
) -> tuple[Float[Array, " n"], Float[Array, "n 6"], Float[Array, "n 6 6"]]:
    """Potential of a law with its derivatives in (u, p).

    Parameters
    ----------
    law : to evaluate.
    curvature : [1/m], body frame.
    pressure : gauge pressure of each chamber [Pa].

    Returns
    -------
    value : Π [J/m].
    gradient : (m, −V), in N m and m².
    hessian : of Π in (u, p), SI.
    """
    c, c_p, c_pp = _coefficients(law, pressure)
    u_s = law.curvature_scale
    w = curvature / u_s - c[:, 1:4]
    phi, phi_w, phi_ww = _monomials(w)
    k, k_p, k_pp = (part[..., 4:] * _MULTIPLICITY for part in (c, c_p, c_pp))
    w_p, w_pp = -c_p[..., 1:4], -c_pp[..., 1:4]  # (3, n, 3) and (6, n, 3); the first axis is that of pressure

    slope = jnp.einsum("nka,nk->na", phi_w, k)  # derivatives of S(w, p) = φ(w)·k(p) by w
    tangent = jnp.einsum("nkab,nk->nab", phi_ww, k)
    slope_p = jnp.einsum("nka,pnk->npa", phi_w, k_p)
    tangent_w_p = jnp.einsum("nab,pnb->npa", tangent, w_p)

    value = c[:, 0] + jnp.einsum("nk,nk->n", phi, k)
    by_p = c_p[..., 0].T + jnp.einsum("nk,pnk->np", phi, k_p) + jnp.einsum("na,pna->np", slope, w_p)
    by_up = slope_p + tangent_w_p  # (n, p, u), times u_s
    cross = jnp.einsum("npa,qna->npq", slope_p, w_p)
    second = c_pp[..., 0] + jnp.einsum("nk,snk->sn", phi, k_pp) + jnp.einsum("na,sna->sn", slope, w_pp)
    by_pp = (
        jnp.moveaxis(second[_SYMMETRIC], -1, 0)
        + cross
        + jnp.swapaxes(cross, 1, 2)
        + jnp.einsum("npa,qna->npq", tangent_w_p, w_p)
    )
    e, v_0 = law.energy_scale, law.rest_volume
    hessian = jnp.concatenate(
        [
            jnp.concatenate([tangent / u_s**2, jnp.swapaxes(by_up, 1, 2) / u_s], axis=2),
            jnp.concatenate([by_up / u_s, by_pp], axis=2),
        ],
        axis=1,
    )
    gradient = jnp.concatenate([e * slope / u_s, e * by_p - v_0], axis=1)
    return e * value - v_0 * pressure.sum(axis=1), gradient, e * hessian


def _coefficients(law: FreeStateExpansion, pressure: Array) -> Jet:
    """Coefficients a, û/u_s, K, C₃, C₄ of the law with their derivatives by pressure."""
    rest = _network(law, jnp.zeros((1, 3)))[0][0]
    rest = rest * (np.arange(rest.size) < 4)  # a and û vanish at rest
    if not law.mirror:
        c, c_p, c_pp = _network(law, pressure)
        return c - rest, c_p, c_pp
    n = len(pressure)
    both = _network(law, jnp.concatenate([pressure, pressure[:, _SWAP]]))
    (c, c_p, c_pp), (d, d_p, d_pp) = [part[..., :n, :] for part in both], [part[..., n:, :] for part in both]
    rest = 0.5 * (rest + rest * _PARITY)
    return (
        0.5 * (c + d * _PARITY) - rest,
        0.5 * (c_p + d_p[_SWAP] * _PARITY),
        0.5 * (c_pp + d_pp[_SWAP_SECOND] * _PARITY),
    )


def _network(law: FreeStateExpansion, pressure: Array) -> Jet:
    x, x_p, x_pp = _inputs(law, pressure)
    last = len(law.weights) - 1
    for layer, (weight, bias) in enumerate(zip(law.weights, law.biases, strict=True)):
        x, x_p, x_pp = x @ weight.T + bias, x_p @ weight.T, x_pp @ weight.T
        if layer < last:
            a = jnp.tanh(x)
            slope = 1.0 - a**2
            products = jnp.stack([x_p[i] * x_p[j] for i, j in _SECOND])
            x, x_p, x_pp = a, slope * x_p, slope * (x_pp - 2.0 * a * products)
    return x, x_p, x_pp


def _inputs(law: FreeStateExpansion, pressure: Array) -> Jet:
    """Scaled or warped pressures; each depends on its own pressure alone."""
    if law.pressure_warp is None:
        x, slope, bend = (
            pressure / law.pressure_scale,
            jnp.full_like(pressure, 1 / law.pressure_scale),
            0 * pressure,
        )
    else:
        scale, q = math.asinh(law.pressure_scale / law.pressure_warp), pressure / law.pressure_warp
        x = jnp.arcsinh(q) / scale
        slope = 1 / (scale * law.pressure_warp * jnp.sqrt(1 + q**2))
        bend = -slope * q / (law.pressure_warp * (1 + q**2))
    x_p = jnp.stack([slope * np.eye(3)[i] for i in range(3)])
    x_pp = jnp.stack([bend * np.eye(3)[i] * (i == j) for i, j in _SECOND])
    return x, x_p, x_pp


def _monomials(w: Array) -> tuple[Array, Array, Array]:
    """Monomials of degree 2 to 4 in w, (n, 31), first (n, 31, 3) and second (n, 31, 3, 3) derivatives."""
    ones = jnp.ones_like(w)
    powers = jnp.stack([ones, w, w**2, w**3, w**4])  # (5, n, 3)
    slopes = jnp.stack([0 * ones, ones, 2 * w, 3 * w**2, 4 * w**3])
    bends = jnp.stack([0 * ones, 0 * ones, 2 * ones, 6 * w, 12 * w**2])
    kinds = jnp.stack([powers, slopes, bends])  # how often each axis is differentiated

    def term(orders: Int[np.ndarray, "3"]) -> Array:
        x, y, z = (kinds[orders[axis], _EXPONENTS[:, axis], :, axis] for axis in range(3))
        return (x * y * z).T

    unit = np.eye(3, dtype=int)
    first = jnp.stack([term(unit[a]) for a in range(3)], axis=-1)
    second = [jnp.stack([term(unit[a] + unit[b]) for b in range(3)], axis=-1) for a in range(3)]
    return term(np.zeros(3, dtype=int)), first, jnp.stack(second, axis=-2)
