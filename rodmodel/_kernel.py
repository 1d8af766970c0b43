"""Compile a function of small arrays to one function of machine code."""

import math
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_batching import custom_vmap
from jax.experimental.xla_metadata import set_xla_metadata
from jaxtyping import Array, Float

from rodmodel._constants import gather_constants

# On a CPU, XLA starts a kernel for each fused operation, at 50 ns or more, which is what small arrays cost. A
# call with these attributes it compiles to one kernel, loops included: what it does by itself for loops over
# less than 1 kB. Library calls (LAPACK), scatters and sorts cannot be in it; matrix products can, where an
# option of the whole compilation keeps XLA from leaving them to a library. Each constant in a kernel costs
# 100 ns a call: they are gathered into one.

_WITHOUT_LIBRARY = {"xla_cpu_experimental_ynn_fusion_type": ""}
_ONE_KERNEL = {"xla_cpu_small_call": "true", "inlineable": "false"}


def one_kernel(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function, compiled to one kernel on a CPU and run row by row under `jax.vmap`.

    Row by row, a loop ends when the row is done. Elsewhere than on a CPU, it is left to XLA and `jax.vmap`.
    Not to be differentiated.

    Parameters
    ----------
    function : from pytrees of arrays of one floating-point type to a pytree of arrays of any type, whole
        numbers in which are exact in that type.
    arguments : of the function. Numbers among them are left as they are, as constants.

    Returns
    -------
    result : of the function.
    """
    arrays, numbers = eqx.partition(arguments, eqx.is_array)
    leaves, structure = jax.tree.flatten(arrays)
    dtype = jnp.result_type(*leaves)
    shapes = [jnp.shape(leaf) for leaf in leaves]
    size = sum(map(math.prod, shapes))
    answers: Any = None

    # One array in and one out: XLA fails on calls within loops whose arguments share or skip buffers.
    def flat(values: Float[Array, " n"]) -> Float[Array, " m"]:
        nonlocal answers
        parts = _unpack(values, shapes)
        result = function(*eqx.combine(jax.tree.unflatten(structure, parts), numbers))
        answers = jax.eval_shape(lambda: result)
        return _pack(jax.tree.leaves(result), dtype)

    rewritten, constants = gather_constants(flat, jax.ShapeDtypeStruct((size,), dtype))
    count = constants.size

    @jax.jit
    def one(given: Float[Array, " k"]) -> Float[Array, " m"]:
        return rewritten(given[count:], given[:count])

    @jax.jit
    def each(given: Float[Array, " k"]) -> Float[Array, "rows m"]:
        return jax.lax.map(lambda row: rewritten(row, given[:count]), given[count:].reshape(-1, size))

    @custom_vmap
    @jax.jit  # XLA aborts on such a call that is not within another function.
    def call(values: Float[Array, " n"]) -> Float[Array, " m"]:
        return _call(one, jnp.concatenate([constants, values]))

    @custom_vmap
    @jax.jit
    def call_each(values: Float[Array, "rows n"]) -> Float[Array, "rows m"]:
        if jax.default_backend() != "cpu":
            return jax.vmap(rewritten, (0, None))(values, jnp.asarray(constants))
        return _call(each, jnp.concatenate([constants, values.ravel()]))

    @call.def_vmap
    def rows(size: int, batched: list[bool], values: Float[Array, "rows n"]) -> tuple[Array, bool]:
        del size, batched
        return call_each(values), True

    @call_each.def_vmap
    def more_rows(size: int, batched: list[bool], values: Float[Array, "more rows n"]) -> tuple[Array, bool]:
        del size, batched
        found = call_each(values.reshape(-1, values.shape[-1]))
        return found.reshape(*values.shape[:2], -1), True

    expected, answer_structure = jax.tree.flatten(answers)
    parts = _unpack(call(_pack(leaves, dtype)), [answer.shape for answer in expected])
    typed = [part.astype(answer.dtype) for part, answer in zip(parts, expected, strict=True)]
    return jax.tree.unflatten(answer_structure, typed)


def compile_with_kernels(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function by `jax.jit`, so that what is one kernel in it may hold matrix products."""
    on_cpu = jax.default_backend() == "cpu"
    return jax.jit(function, compiler_options=_WITHOUT_LIBRARY if on_cpu else None)


def as_data(function: Callable[[Any], Any], tree: Any) -> Any:
    """What follows from constants, computed in NumPy without compilation, and data to the compiler.

    Constants it would copy to wherever they are used. What is being traced is left to it.
    """
    if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(tree)):
        return function(tree)
    leaves, structure = jax.tree.flatten(function(jax.tree.map(np.asarray, tree)))
    # As one array: each constant costs by itself.
    packed = jnp.asarray(np.concatenate([np.ravel(leaf) for leaf in leaves]))
    parts = _unpack(jax.lax.optimization_barrier(packed), [np.shape(leaf) for leaf in leaves])
    return jax.tree.unflatten(structure, parts)


def _pack(leaves: list[Any], dtype: jnp.dtype) -> Float[Array, " n"]:
    return jnp.concatenate([jnp.ravel(leaf).astype(dtype) for leaf in leaves])


def _unpack(values: Float[Array, " n"], shapes: list[tuple[int, ...]]) -> list[Array]:
    parts, first = [], 0
    for shape in shapes:
        last = first + math.prod(shape)
        parts.append(values[first:last].reshape(shape))
        first = last
    return parts


def _call(compiled: Callable[[Array], Array], values: Array) -> Array:
    if jax.default_backend() != "cpu":
        return compiled(values)
    with set_xla_metadata(**_ONE_KERNEL):
        return compiled(values)
