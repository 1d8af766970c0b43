"""Errors of a solve, raised outside its compiled function."""

from collections.abc import Sequence
from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool

T = TypeVar("T")


def raise_where(result: T, problems: Bool[Array, " n"], messages: Sequence[str]) -> T:
    """Return a result, or raise the message of its first problem.

    The check is outside the compiled function: JAX does not cache a function that calls back to raise, so
    every process would compile it anew.

    Parameters
    ----------
    result : result of the solve.
    problems : flags, one for each message.
    messages : n messages.

    Raises
    ------
    RuntimeError
        At once; under tracing, when the traced function is run.
    """
    if isinstance(problems, jax.core.Tracer):
        return eqx.branched_error_if(result, jnp.any(problems), jnp.argmax(problems), messages)
    known = np.asarray(problems)
    # Raised by Equinox, so that its EQX_ON_ERROR holds.
    return eqx.branched_error_if(result, True, int(np.argmax(known)), messages) if known.any() else result
