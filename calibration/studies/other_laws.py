"""Other forms of the section potential, for comparison only: a polynomial and a plain network in (u, p).

Like the shipped law, both are mirror-symmetric, vanish at rest together with their moment, and are contracted
once with the pressures.
"""

import abc
import itertools
from typing import Any, final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax import Array
from jaxtyping import Float

from calibration.fit import HESSIAN_WEIGHT, Metric, Samples, Scales
from rodmodel import CurvatureLaw, SectionLaw

_MIRROR = np.array([-1.0, 1.0, -1.0])  # mirror image of a curvature
_SWAP = np.array([0, 2, 1])  # chambers of the mirror image


class _Candidate(SectionLaw):
    """Law whose free curvature is computed only on demand."""

    def contracted(self, pressure: Float[Array, "3"]) -> Any:
        """See `rodmodel.SectionLaw.contracted`."""
        return self.at(pressure)


class _Contracted(CurvatureLaw):
    """Potential at one pressure, differentiated automatically."""

    @abc.abstractmethod
    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π [J/m]."""

    # A property may implement an abstract variable of Equinox; a type checker does not know this.
    @property  # type: ignore[misc]
    def free_curvature(self) -> Float[Array, "3"]:  # type: ignore[override]
        """Root of the moment, by Newton's method from the straight section."""
        unit = jnp.trace(self.stiffness(jnp.zeros(3))) / 3.0
        solver: optx.Newton = optx.Newton(rtol=1e-8, atol=1e-8)
        return optx.root_find(lambda u, _: self.moment(u) / unit, solver, jnp.zeros(3), throw=False).value

    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Moment ∂Π/∂u [N m]."""
        return jax.grad(self.energy)(curvature)

    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Tangent stiffness ∂²Π/∂u² [N m²]."""
        return jax.hessian(self.energy)(curvature)


@final
class PolynomialLaw(_Candidate):
    """Total-degree polynomial, Π = Σ_ab C_ab u^a p^b over |a| + |b| ≤ degree, in scaled (u, p)."""

    coefficients: Float[Array, "a b"]
    degree: int = eqx.field(static=True)
    curvature_scale: float = eqx.field(static=True)
    pressure_scale: float = eqx.field(static=True)

    def at(self, pressure: Float[Array, "3"]) -> Any:
        """Contract the pressures' monomials."""
        by_pressure = _monomials(pressure / self.pressure_scale, self.degree)
        contracted: Any = PolynomialInCurvature
        return contracted(self.coefficients @ by_pressure, self.degree, self.curvature_scale)


@final
class PolynomialInCurvature(_Contracted):
    """Polynomial of the curvature, Σ_a c_a u^a."""

    coefficients: Float[Array, " a"]
    degree: int = eqx.field(static=True)
    curvature_scale: float = eqx.field(static=True)

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π [J/m]."""
        return self.coefficients @ _monomials(curvature / self.curvature_scale, self.degree)


@final
class NetworkLaw(_Candidate):
    """Tanh network of scaled (u, p) with one output, mirror-symmetric and with zero moment at rest."""

    layers: eqx.nn.MLP
    curvature_scale: float = eqx.field(static=True)
    pressure_scale: float = eqx.field(static=True)
    energy_scale: float = eqx.field(static=True)
    rest_volume: float = eqx.field(static=True)

    def at(self, pressure: Float[Array, "3"]) -> Any:
        """Contract the first layer with the pressures."""
        first = self.layers.layers[0]
        pressures = jnp.stack([pressure, pressure[_SWAP], 0.0 * pressure]) / self.pressure_scale
        offsets = pressures @ first.weight[:, 3:].T + _bias(first)
        contracted: Any = NetworkInCurvature
        return contracted(self, offsets, -self.rest_volume * jnp.sum(pressure))


@final
class NetworkInCurvature(_Contracted):
    """The network at one pressure."""

    law: NetworkLaw
    offsets: Float[Array, "3 h"]
    constant: Float[Array, ""]

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π [J/m]."""
        u = curvature / self.law.curvature_scale
        here, there, rest = self.offsets
        output = 0.5 * (self._output(u, here) + self._output(u * _MIRROR, there))
        # The value at rest and the slope are subtracted; by mirror symmetry only the slope by u2 is left.
        value, slope = jax.value_and_grad(self._output)(jnp.zeros(3), rest)
        return self.law.energy_scale * (output - value - slope[1] * u[1]) + self.constant

    def _output(self, u: Array, offset: Array) -> Array:
        first, *inner, last = self.law.layers.layers
        x = jnp.tanh(first.weight[:, :3] @ u + offset)
        for layer in inner:
            x = jnp.tanh(layer(x))
        return (last(x))[0]


def network_law(scales: Scales, seed: int, hidden: int = 24) -> NetworkLaw:
    """Return an untrained 6–hidden–hidden–1 network."""
    layers = eqx.nn.MLP(6, 1, hidden, 2, activation=jnp.tanh, key=jax.random.PRNGKey(seed))
    return NetworkLaw(layers, scales.curvature, scales.pressure, scales.energy, scales.rest_volume)


def _bias(layer: eqx.nn.Linear) -> Array:
    assert layer.bias is not None  # these networks have biases
    return layer.bias


def fit_polynomial(samples: Samples, metric: Metric, scales: Scales, degree: int) -> PolynomialLaw:
    """Fit a polynomial by linear least squares to the residuals of the other laws."""
    indices = _exponents(degree)
    terms = [
        (i, j)
        for (i, a), (j, b) in itertools.product(enumerate(indices), repeat=2)
        if sum(a) + sum(b) <= degree and sum(a) + sum(b) > 0 and (sum(b) > 0 or sum(a) > 1)
    ]
    exponents = np.array([(*indices[i], *indices[j]) for i, j in terms])
    mirrored = {tuple(e): n for n, e in enumerate(exponents.tolist())}
    # A pair of mirror images is one unknown with the sign of its parity; odd terms that are their own image
    # vanish.
    image = np.array([mirrored[(a, b, c, p, r, q)] for a, b, c, p, q, r in exponents.tolist()])
    parity = (-1.0) ** (exponents[:, 0] + exponents[:, 2])
    kept = np.flatnonzero((image > np.arange(len(image))) | ((image == np.arange(len(image))) & (parity > 0)))
    to_all = np.zeros((len(terms), len(kept)))
    to_all[kept, np.arange(len(kept))] = 1.0
    to_all[image[kept], np.arange(len(kept))] = parity[kept]

    unit = np.array([scales.curvature] * 3 + [scales.pressure] * 3)
    y = np.concatenate([samples.curvature, samples.pressure], axis=1) / unit
    triangle = np.zeros((0, len(kept) + 1))
    for rows in np.array_split(np.arange(len(samples)), max(1, len(samples) // 100)):
        gradient, hessian = _slopes(y[rows], exponents)
        gradient, hessian = (
            (gradient @ to_all) / unit[:, None],
            (hessian @ to_all) / np.outer(unit, unit)[..., None],
        )
        weight = metric.gradient[rows]
        near = HESSIAN_WEIGHT * metric.step
        left = [
            np.einsum("nij,njk->nik", weight, gradient).reshape(-1, len(kept)),
            np.einsum("nij,njmk,m->nimk", weight, hessian, near).reshape(-1, len(kept)),
        ]
        right = [
            np.einsum("nij,nj->ni", weight, samples.gradient[rows]).reshape(-1, 1),
            np.einsum("nij,njm,m->nim", weight, samples.hessian[rows], near).reshape(-1, 1),
        ]
        # QR in chunks: the full matrix is too large, and normal equations would square the condition number.
        stacked = np.vstack([triangle, np.hstack([np.vstack(left), np.vstack(right)])])
        triangle = np.asarray(np.linalg.qr(stacked, mode="r"))
    scale = np.linalg.norm(triangle[:, :-1], axis=0)
    solution = np.linalg.lstsq(triangle[:, :-1] / scale, triangle[:, -1], rcond=1e-12)[0] / scale
    coefficients = np.zeros((len(indices), len(indices)))
    for (i, j), value in zip(terms, to_all @ solution, strict=True):
        coefficients[i, j] = value
    return PolynomialLaw(jnp.asarray(coefficients), degree, scales.curvature, scales.pressure)


def _exponents(degree: int) -> list[tuple[int, int, int]]:
    some = range(degree + 1)
    return [(a, b, c) for a in some for b in some for c in some if a + b + c <= degree]


def _monomials(x: Array, degree: int) -> Array:
    exponents = np.array(_exponents(degree))
    powers = jnp.concatenate([jnp.ones((1, 3), x.dtype), jnp.cumprod(jnp.tile(x, (degree, 1)), axis=0)])
    return powers[exponents[:, 0], 0] * powers[exponents[:, 1], 1] * powers[exponents[:, 2], 2]


def _slopes(y: np.ndarray, exponents: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return first (n, 6, terms) and second (n, 6, 6, terms) derivatives of monomials."""

    def term(orders: np.ndarray) -> np.ndarray:
        result = np.ones((len(y), len(exponents)))
        for axis, order in enumerate(orders):
            e = exponents[:, axis]
            factor = np.where(order >= 1, e, 1) * np.where(order == 2, e - 1, 1)
            result *= factor * y[:, axis, None] ** np.maximum(e - order, 0)
        return result

    unit = np.eye(6, dtype=int)
    first = np.stack([term(unit[i]) for i in range(6)], axis=1)
    second = np.empty((len(y), 6, 6, len(exponents)))
    for i, j in itertools.combinations_with_replacement(range(6), 2):
        second[:, i, j] = second[:, j, i] = term(unit[i] + unit[j])
    return first, second
