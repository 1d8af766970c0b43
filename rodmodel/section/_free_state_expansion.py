"""The section law that calibrations ship: an expansion about the free state."""

import itertools
import math
from typing import final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel.section._law import PAIRS, QUADRUPLES, TRIPLES, SectionLaw
from rodmodel.section._quartic import QuarticLaw, symmetric_tensor
from rodmodel.section._ridges import weighted_sum

# What each output of the network multiplies, as the axes it carries: a (none), û, K, C₃, C₄.
_INDICES: tuple[tuple[int, ...], ...] = ((), (0,), (1,), (2,), *PAIRS, *TRIPLES, *QUADRUPLES)
COEFFICIENTS = len(_INDICES)
_SPLITS = np.cumsum([1, 3, len(PAIRS), len(TRIPLES)])

# The mirror y → −y swaps chambers 2 and 3 and turns the sign of the curvatures about x and of the twist.
_MIRRORED_CHAMBERS = np.array([0, 2, 1])
_MIRROR_SIGNS = np.array([(-1.0) ** sum(axis != 1 for axis in index) for index in _INDICES])

# The potential and the free curvature vanish without pressure; stiffnesses do not.
_VANISHES_AT_REST = np.array([1.0] * 4 + [0.0] * (COEFFICIENTS - 4))


@final
class FreeStateExpansion(SectionLaw):
    """Quartic polynomial of the curvature about the free state, its coefficients functions of pressure.

        Π(u, p) = −V₀ Σ p_k + E [a(p) + ½ wᵀ K(p) w + C₃(p)[w, w, w] + C₄(p)[w, w, w, w]]
        w = (u − û(p))/u_s

    The independent entries of a (1), û/u_s (3), K (6), C₃ (10) and C₄ (15), in this order and each
    symmetric tensor by non-decreasing indices, are the 35 outputs of a tanh network of the scaled
    pressures. There is no linear term in w, so the moment vanishes exactly at û(p), which needs no
    iteration. a and û are taken relative to p = 0, so that Π(0, 0) = 0 and û(0) = 0 exactly.

    Attributes
    ----------
    weights, biases : of the network's layers, first to last: (out, in) and (out,). Three inputs, 35 outputs.
    pressure_scale : the pressure that the network sees as 1 [Pa].
    curvature_scale : u_s [1/m].
    energy_scale : E [J/m].
    rest_volume : V₀, chamber volume per length at rest [m²], up to what a(p) adds.
    pressure_warp : where given, the network sees asinh(p/warp)/asinh(scale/warp) in place of p/scale [Pa]: it
        resolves the soft response below the warp and is as smooth.
    mirror : whether the section has the mirror y → −y, as at ψ = 0. Each coefficient is then made even or odd
        under the swap of chambers 2 and 3.
    """

    weights: tuple[Float[Array, "_ _"], ...]
    biases: tuple[Float[Array, " _"], ...]
    pressure_scale: float = eqx.field(static=True)
    curvature_scale: float = eqx.field(static=True)
    energy_scale: float = eqx.field(static=True)
    rest_volume: float = eqx.field(static=True)
    pressure_warp: float | None = eqx.field(static=True, default=None)
    mirror: bool = eqx.field(static=True, default=True)

    def __check_init__(self) -> None:
        """Refuse layers that do not lead from 3 pressures to 35 coefficients, and impossible scales."""
        sizes = [3, *(bias.shape[0] for bias in self.biases)]
        shapes = [weight.shape for weight in self.weights]
        if (
            shapes != [(n_out, n_in) for n_in, n_out in itertools.pairwise(sizes)]
            or sizes[-1] != COEFFICIENTS
        ):
            raise ValueError(
                f"weights, biases: got shapes {shapes} and {[bias.shape for bias in self.biases]}, expected "
                f"(out, in) and (out,) for each layer, from 3 pressures to {COEFFICIENTS} coefficients"
            )
        for name in ("pressure_scale", "curvature_scale", "energy_scale", "rest_volume", "pressure_warp"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name}: got {value}, expected a positive number")

    def at(self, pressure: Float[Array, "3"]) -> QuarticLaw:
        """Contract the law to a quartic polynomial of the curvature."""
        coefficients = self._coefficients(pressure)
        constant, free, quadratic, cubic, quartic = jnp.split(coefficients, _SPLITS)
        return QuarticLaw(
            constant=constant[0] - self.rest_volume / self.energy_scale * jnp.sum(pressure),
            free_curvature=self.curvature_scale * free,
            quadratic=symmetric_tensor(quadratic, PAIRS),
            cubic=symmetric_tensor(cubic, TRIPLES),
            quartic=symmetric_tensor(quartic, QUADRUPLES),
            energy_scale=self.energy_scale,
            curvature_scale=self.curvature_scale,
        )

    def _coefficients(self, pressure: Float[Array, "3"]) -> Float[Array, "35"]:
        """Network outputs, made to vanish at rest where they must and even or odd under the mirror."""
        # One product for all rows: the same operations on each, so that what must cancel does so to the
        # last bit.
        rows = jnp.stack([pressure, pressure[_MIRRORED_CHAMBERS], jnp.zeros_like(pressure)])
        here, mirrored, rest = jax.vmap(self._network)(rows)
        rest = rest * _VANISHES_AT_REST.astype(rest.dtype)
        if not self.mirror:
            return here - rest
        return 0.5 * ((here - rest) + (mirrored - rest) * _MIRROR_SIGNS.astype(rest.dtype))

    def _network(self, pressure: Float[Array, "3"]) -> Float[Array, "35"]:
        if self.pressure_warp is None:
            x = pressure / self.pressure_scale
        else:
            x = jnp.arcsinh(pressure / self.pressure_warp) / math.asinh(
                self.pressure_scale / self.pressure_warp
            )
        *hidden, last = zip(self.weights, self.biases, strict=True)
        for weight, bias in hidden:
            x = jnp.tanh(weighted_sum(x, weight.T) + bias)
        weight, bias = last
        return weighted_sum(x, weight.T) + bias
