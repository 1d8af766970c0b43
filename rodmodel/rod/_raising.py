"""Raise where a solve met a problem, outside of what is compiled for it."""

from collections.abc import Sequence
from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool

T = TypeVar("T")


def raise_where(result: T, problems: Bool[Array, " n"], messages: Sequence[str]) -> T:
    """Return a result, or raise the message of the first of its problems.

    Checked outside of the compiled function, where numbers are known: a function that calls back to raise is
    compiled anew in every process, as JAX keeps none such in its compilation cache.

    Parameters
    ----------
    result : what was found.
    problems : which of the messages are true of it.
    messages : n of them.

    Raises
    ------
    RuntimeError
        At once, or when the function that this is traced into is run.
    """
    if isinstance(problems, jax.core.Tracer):
        return eqx.branched_error_if(result, jnp.any(problems), jnp.argmax(problems), messages)
    known = np.asarray(problems)
    # The way through Equinox keeps to its EQX_ON_ERROR.
    return eqx.branched_error_if(result, True, int(np.argmax(known)), messages) if known.any() else result
