"""Vectors, symmetric tensors and quaternions as tuples of scalars.

XLA runs each operation on a small array as a loop of its own, with a store and a load around it; operations
on scalars it fuses into straight code. What a rod is integrated with is written in scalars, therefore. When
it fuses, it computes again for each result what several share; a function under `jax.jit` it leaves alone
inside of one kernel (see `_kernel`), so that what is shared is computed once.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jaxtyping import Array

Scalar = Array
Triple = tuple[Scalar, Scalar, Scalar]
Quaternion = tuple[Scalar, Scalar, Scalar, Scalar]
"""Scalar part first, of unit length."""
Symmetric = tuple[Scalar, Scalar, Scalar, Scalar, Scalar, Scalar]
"""Entries 11, 12, 13, 22, 23, 33."""

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
_POSITION = {pair: n for n, pair in enumerate(PAIRS)}
_ROWS = tuple(tuple(_POSITION[min(i, j), max(i, j)] for j in range(3)) for i in range(3))
_TRIPLES = tuple((i, j, k) for i in range(3) for j in range(i, 3) for k in range(j, 3))
_TRIPLE_POSITION = {triple: n for n, triple in enumerate(_TRIPLES)}
_TRIPLE_ROWS = tuple(
    tuple(_TRIPLE_POSITION[tuple(sorted((*pair, k)))] for k in range(3))  # type: ignore[index]
    for pair in PAIRS
)

# Terms of the series of the exponential, and how often its angle is halved before. For an angle of two turns
# the first term dropped is 1e-15.
_TERMS = 9
_HALVINGS = 3


def triple(vector: Array) -> Triple:
    """Components of an array of three."""
    return vector[0], vector[1], vector[2]


def combine(*terms: tuple[float | Scalar, Sequence[Scalar]]) -> Triple:
    """Sum Σ cᵢ vᵢ of vectors."""
    (c, v), *others = terms
    x, y, z = c * v[0], c * v[1], c * v[2]
    for c, v in others:
        x, y, z = x + c * v[0], y + c * v[1], z + c * v[2]
    return x, y, z


def cross(a: Triple, b: Triple) -> Triple:
    """Product a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a: Triple, b: Triple) -> Scalar:
    """Product a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def axis_cross(v: Triple) -> Triple:
    """Product e₃ × v."""
    return -v[1], v[0], jnp.zeros_like(v[0])


@jax.jit
def into_body(q: Quaternion, v: Triple) -> Triple:
    """Components Rᵀv in the body frame of a vector of the base frame."""
    a = q[1:]
    t = cross(v, a)
    return combine((1.0, v), (2.0 * q[0], t), (2.0, cross(t, a)))


@jax.jit
def out_of_body(q: Quaternion, v: Triple) -> Triple:
    """Components R v in the base frame of a vector of the body frame."""
    a = q[1:]
    t = cross(a, v)
    return combine((1.0, v), (2.0 * q[0], t), (2.0, cross(a, t)))


@jax.jit
def apply(matrix: Symmetric, v: Triple) -> Triple:
    """Product of a symmetric matrix and a vector."""
    x, y, z = (matrix[i] * v[0] + matrix[j] * v[1] + matrix[k] * v[2] for i, j, k in _ROWS)
    return x, y, z


@jax.jit
def inverse(matrix: Symmetric) -> Symmetric:
    """Inverse of a symmetric matrix, by Cramer's rule."""
    a, b, c, d, e, f = matrix
    p, q, r = d * f - e * e, c * e - b * f, b * e - c * d
    scale = 1.0 / (a * p + b * q + c * r)
    return (
        scale * p,
        scale * q,
        scale * r,
        scale * (a * f - c * c),
        scale * (b * c - a * e),
        scale * (a * d - b * b),
    )


@jax.jit
def contract(tensor: Sequence[Scalar], v: Triple) -> Symmetric:
    """Product T·v of a tensor symmetric in three indices, given by its ten entries, and a vector."""
    a, b, c, d, e, f = (tensor[i] * v[0] + tensor[j] * v[1] + tensor[k] * v[2] for i, j, k in _TRIPLE_ROWS)
    return a, b, c, d, e, f


@jax.jit
def solve(columns: tuple[Triple, Triple, Triple], right: Triple) -> Triple:
    """Solve a 3 × 3 system whose matrix is given by columns, by Cramer's rule."""
    a, b, c = columns
    ab, bc, ca = cross(a, b), cross(b, c), cross(c, a)
    scale = 1.0 / dot(a, bc)
    return scale * dot(bc, right), scale * dot(ca, right), scale * dot(ab, right)


@jax.jit
def _exponential_series(x: Scalar) -> tuple[Scalar, Scalar]:
    """(1 − cos φ)/φ² and (φ − sin φ)/φ³ of x = φ²."""
    b, c = jnp.ones_like(x), jnp.ones_like(x)
    for n in range(_TERMS, 0, -1):
        b = 1.0 - x * b * (1.0 / ((2 * n + 1) * (2 * n + 2)))
        c = 1.0 - x * c * (1.0 / ((2 * n + 2) * (2 * n + 3)))
    return 0.5 * b, c * (1.0 / 6.0)


@jax.jit
def turn_by(q: Quaternion, turn: Triple) -> Quaternion:
    """Quaternion of R exp(Ω̂)."""
    return _exponential(q, turn)[0]


@jax.jit
def screw_by(q: Quaternion, turn: Triple, shift: Triple) -> tuple[Quaternion, Triple]:
    """Quaternion of R exp(Ω̂), and the way R V(Ω) w in the base frame: the step (w, Ω) on SE(3).

        V = I + B Ω̂ + C Ω̂²,   B = (1 − cos θ)/θ²,   C = (θ − sin θ)/θ³,   θ = |Ω|

    References
    ----------
    Murray, Li and Sastry (1994), A Mathematical Introduction to Robotic Manipulation, eq. 2.36.
    """
    turned, b, c = _exponential(q, turn)
    once = cross(turn, shift)
    return turned, out_of_body(q, combine((1.0, shift), (b, once), (c, cross(turn, once))))


def _exponential(q: Quaternion, turn: Triple) -> tuple[Quaternion, Scalar, Scalar]:
    """Quaternion of R exp(Ω̂), and B and C of Ω.

    By series at an eighth of the angle and doubling: smooth, also in its derivatives, at zero.
    """
    square = dot(turn, turn)
    b, c = _exponential_series(square * (1.0 / 4**_HALVINGS))
    for n in range(_HALVINGS, 1, -1):
        b, c = _doubled(b, c, square * (1.0 / 4**n))
    x = 0.25 * square
    # Here at half of the angle: cosine, and sine over the angle.
    cosine, sine = 1.0 - x * b, 0.5 * (1.0 - x * c)
    b, c = _doubled(b, c, x)
    w, p = q[0], q[1:]
    vector = combine((cosine, p), (w * sine, turn), (sine, cross(p, turn)))
    return (w * cosine - sine * dot(p, turn), *vector), b, c


@jax.jit
def _doubled(b: Scalar, c: Scalar, x: Scalar) -> tuple[Scalar, Scalar]:
    """B and C at twice the angle, of those at φ and x = φ²."""
    sine = 1.0 - x * c
    return 0.5 * sine * sine, 0.25 * (c + sine * b)
