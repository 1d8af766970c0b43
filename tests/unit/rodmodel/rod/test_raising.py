"""What raises: outside of the compiled function, at once where numbers are known, when it runs where not."""

from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.experimental.compilation_cache import compilation_cache

import rodmodel
from rodmodel.rod._raising import raise_where
from tests.unit.rodmodel.synthetic import ACTUATOR, DOMAIN, linear_law

MESSAGES = ["the first", "the second"]


def test_the_first_of_the_problems_is_told_and_nothing_else() -> None:
    result = jnp.ones(2)
    assert raise_where(result, jnp.array([False, False]), MESSAGES) is result
    with pytest.raises(RuntimeError) as caught:
        raise_where(result, jnp.array([False, True]), MESSAGES)
    assert str(caught.value) == "the second"
    with pytest.raises(RuntimeError, match="the first"):
        raise_where(result, jnp.array([True, True]), MESSAGES)


@pytest.mark.parametrize("transform", [jax.jit, jax.vmap, lambda f: jax.jit(jax.vmap(f))])
def test_within_another_function_it_raises_when_that_runs(transform: Callable) -> None:
    def checked(x: jax.Array) -> jax.Array:
        return raise_where(x, jnp.stack([jnp.any(x > 1.0), jnp.any(x < 0.0)]), MESSAGES)

    outer = transform(checked)
    np.testing.assert_array_equal(outer(jnp.full((2, 2), 0.5)), np.full((2, 2), 0.5))
    with pytest.raises(RuntimeError, match="the second"):
        jax.block_until_ready(outer(jnp.array([[0.5, 0.5], [0.5, -0.5]])))


def test_a_solve_that_may_raise_is_kept_for_the_next_process(tmp_path: Path) -> None:
    rod = rodmodel.Rod(linear_law(), ACTUATOR, DOMAIN, 0.01)
    kept = jax.config.jax_compilation_cache_dir, jax.config.jax_persistent_cache_min_compile_time_secs
    try:
        set_cache(str(tmp_path), 0.0)
        assert rod.solve([0.0, 0.0, 0.0]).converged
    finally:
        set_cache(*kept)
    names = {file.name.rsplit("-", 2)[0] for file in tmp_path.iterdir()}
    assert "jit_solve_rod" in names, names


def set_cache(folder: str, least_seconds: float) -> None:
    jax.config.update("jax_compilation_cache_dir", folder)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", least_seconds)
    compilation_cache.reset_cache()
