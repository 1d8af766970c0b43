"""A section law at pressures near given ones, to be differentiated by them in many directions at once."""

from typing import Any, final

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rodmodel._components import Symmetric, Triple, triple
from rodmodel.section._law import PAIRS, TRIPLES, CurvatureLaw

# Of ∂K/∂u, rows by `PAIRS`: which of the third derivatives each entry is.
_THIRDS = np.array([[TRIPLES.index(tuple(sorted((*pair, k)))) for k in range(3)] for pair in PAIRS])
_ROWS = np.array([[PAIRS.index((min(i, k), max(i, k))) for k in range(3)] for i in range(3)])


@final
class LawNearby(CurvatureLaw):
    """Law at one pressure whose moment and stiffness know their slopes by curvature and pressure.

    Of a law with many ridges each derivative is as long a sum as the law itself. Here all of them are summed
    once at a curvature, and any number of directions share them.

    Attributes
    ----------
    law : at the pressure.
    slopes : derivatives of its leaves by the pressures, on a leading axis.
    shift : of the pressures; to be differentiated at zero [Pa].
    """

    law: CurvatureLaw
    slopes: CurvatureLaw
    shift: Float[Array, "3"]
    free_curvature: Float[Array, "3"]

    def __init__(self, law: CurvatureLaw, slopes: CurvatureLaw, shift: Float[Array, "3"]) -> None:
        self.law, self.slopes, self.shift = law, slopes, shift
        self.free_curvature = law.free_curvature + jnp.sum(slopes.free_curvature * shift[:, None], axis=0)

    def linearise(self, curvature: Triple) -> tuple[Triple, Symmetric]:
        """Moment and stiffness at a curvature [1/m], in scalars."""
        found = _section(self.law, self.slopes, jnp.stack(curvature), self.shift)
        a, b, c, d, e, f = found[3:]
        return triple(found[:3]), (a, b, c, d, e, f)

    def energy(self, curvature: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential Π [J/m]."""
        return self._moved().energy(curvature)

    def moment(self, curvature: Float[Array, "3"]) -> Float[Array, "3"]:
        """Moment ∂Π/∂u [N m]."""
        return self._moved().moment(curvature)

    def stiffness(self, curvature: Float[Array, "3"]) -> Float[Array, "3 3"]:
        """Tangent stiffness ∂²Π/∂u² [N m²]."""
        return self._moved().stiffness(curvature)

    def _moved(self) -> CurvatureLaw:
        moved: CurvatureLaw = jax.tree.map(
            lambda leaf, slope: leaf + jnp.tensordot(self.shift, slope, axes=1), self.law, self.slopes
        )
        return moved


@jax.custom_jvp
def _section(
    law: CurvatureLaw, slopes: CurvatureLaw, curvature: Float[Array, "3"], shift: Float[Array, "3"]
) -> Float[Array, "9"]:
    """Moment, and entries of the stiffness, without shift."""
    del slopes, shift
    moment, stiffness = law.linearise(triple(curvature))
    return jnp.stack([*moment, *stiffness])


@_section.defjvp
def _section_jvp(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[Array, Array]:
    law, slopes, curvature, _ = primals
    _, _, turned, shifted = tangents
    u = triple(curvature)
    section = law.expand(u)
    found = jnp.stack([*section.moment, *section.stiffness])
    by_pressure = jax.vmap(lambda slope: law.slopes_by(u, slope))(slopes)
    third = section.third if section.third is not None else (jnp.zeros_like(u[0]),) * len(TRIPLES)
    by_curvature = jnp.concatenate([found[3:][_ROWS], jnp.stack(third)[_THIRDS]])
    # In sums: a product of matrices, as of many directions at once, cannot be in a kernel.
    change = sum(by_curvature[:, k] * turned[k] + by_pressure[k] * shifted[k] for k in range(3))
    return found, jnp.asarray(change)
