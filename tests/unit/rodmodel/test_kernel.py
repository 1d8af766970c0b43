"""Kernels compute what the functions do that they are made of: alone, in batches and batches of those."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rodmodel._constants import gather_constants
from rodmodel._kernel import compile_with_kernels, one_kernel

TABLE = np.array([0.25, 0.5, 2.0])
LARGE = np.linspace(1.0, 2.0, 50)


@jax.custom_jvp
def _cubed(x):
    return jax.jit(jnp.where)(x > 0.125, x, 0.125) ** 3


_cubed.defjvp(lambda x, dx: (_cubed(*x), 3.0 * x[0] ** 2 * dx[0]))


def everything(values):
    """Each kind of what a kernel is made of, with constants in it."""

    def body(total, x):
        return total + jnp.where(x > 0.75, x, 0.375) * TABLE[1], jnp.dot(x * TABLE, TABLE)

    total, each = jax.lax.scan(body, 0.0625, values)
    grown, count = jax.lax.while_loop(
        lambda at: (at[0] < 40.0) & (at[1] < 100), lambda at: (at[0] * 1.5 + TABLE[0], at[1] + 1), (total, 0)
    )
    chosen = jax.lax.cond(grown > 50.0, lambda x, y: x - 7.5 * y, lambda x, y: x + 3.25 * y, grown, 0.03125)
    vector = jax.vmap(_cubed)(values) @ jnp.ones(values.size)
    return jnp.concatenate([each, jnp.stack([chosen, vector, jnp.sum(LARGE) * values[0], 1.0 * count])])


def test_function_with_gathered_constants_is_the_same() -> None:
    values = jnp.array([0.5, 1.0, 0.1, 3.0])
    rewritten, constants = gather_constants(everything, jax.ShapeDtypeStruct((4,), np.dtype(float)))
    assert constants.size >= TABLE.size
    assert set(TABLE) | {0.0625, 0.03125} <= set(constants)
    assert not np.isin(LARGE[1:-1], constants).any()
    # The same operations in the same order; the compiler may contract a product and a sum into one rounding.
    np.testing.assert_allclose(
        jax.jit(rewritten)(values, jnp.asarray(constants)), everything(values), rtol=1e-14
    )


def test_gathered_constants_are_read_from_the_array() -> None:
    """All but those in arithmetic: with constants that are not numbers, nothing that has some is one."""
    values = jnp.array([0.5, 1.0, 0.1, 3.0])
    rewritten, constants = gather_constants(everything, jax.ShapeDtypeStruct((4,), np.dtype(float)))
    found = np.asarray(rewritten(values, jnp.full_like(constants, jnp.nan)))
    assert np.isnan(found[:6]).all()
    # A loop that does not begin, as its condition is of no number, counts nothing.
    np.testing.assert_allclose(found[6:], [LARGE.sum() * values[0], 0.0], rtol=1e-14)


def test_constants_of_another_type_stay_in_the_function() -> None:
    values = jnp.array([0.5, 1.0, 0.1, 3.0], jnp.float32)
    rewritten, constants = gather_constants(
        lambda x: jnp.where(x > 0.2, x.astype(float) * TABLE[0], 0.5),
        jax.ShapeDtypeStruct((4,), values.dtype),
    )
    assert constants.size == 0
    np.testing.assert_array_equal(rewritten(values, jnp.asarray(constants)), [0.125, 0.25, 0.5, 0.75])


def test_function_that_calls_python_keeps_its_constants() -> None:
    def careful(x):
        hurt = jax.pure_callback(lambda y: y, jax.ShapeDtypeStruct((), x.dtype), x[0])
        return x + jnp.where(jnp.array(False), hurt, 0.5)

    assert gather_constants(careful, jax.ShapeDtypeStruct((2,), np.dtype(float)))[1].size == 0


@pytest.mark.parametrize("shape", [(), (5,), (2, 5), (2, 1, 5)])
def test_kernel_in_batches_of_any_depth(shape: tuple[int, ...]) -> None:
    """The rows of a batch, one after another, are what each is alone."""

    def function(x, scale):
        return {"sum": everything(scale * x), "large": jnp.any(x > 0.9)}

    def called(x, scale):
        return one_kernel(function, x, scale)

    values = np.random.default_rng(3).uniform(size=(*shape, 4))
    scales = 1.0 + np.arange(values[..., 0].size).reshape(shape)
    batched, alone = called, function
    for _ in shape:
        batched, alone = jax.vmap(batched), jax.vmap(alone)
    found, expected = compile_with_kernels(batched)(values, scales), alone(values, scales)
    np.testing.assert_allclose(found["sum"], expected["sum"], rtol=1e-13)
    np.testing.assert_array_equal(found["large"], expected["large"])


def test_batch_of_one_argument_alone() -> None:
    """What the rows share need not be repeated by the caller."""
    values = np.random.default_rng(4).uniform(size=(6, 4))
    called = compile_with_kernels(
        jax.vmap(lambda x, y: one_kernel(lambda x, y: everything(x * y), x, y), (0, None))
    )
    np.testing.assert_allclose(called(values, 2.0), jax.vmap(everything)(2.0 * values), rtol=1e-13)
