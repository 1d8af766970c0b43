"""The floating-point constants of a function, gathered into one array that it is given."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend import core
from jaxtyping import Array, Float

# What JAX calls functions with rules of their own, by the parameter that holds the function.
_RULED = {"custom_jvp_call": "call_jaxpr", "custom_vjp_call": "call_jaxpr", "custom_vmap_call": "call"}
_CALLBACK = "pure_callback"
# Numbers in a constant. A larger one costs more to pass on than by itself.
_LARGEST = 16


def gather_constants(
    function: Callable[[Array], Array], example: jax.ShapeDtypeStruct
) -> tuple[Callable[[Array, Array], Array], np.ndarray]:
    """Rewrite a function so that it reads its constants from an array.

    Those are small arrays, and numbers that loops, branches and compiled functions within it are given.
    Numbers in arithmetic stay: they are part of the machine code. A function with calls back to Python keeps
    all: from them XLA may see that it never calls.

    Parameters
    ----------
    function : of an array to an array, not to be differentiated any more.
    example : shape and type of what it is given; constants of other types stay where they are.

    Returns
    -------
    function : of what it was of, and the constants.
    constants : (n,), of the type of the example.
    """
    closed = jax.make_jaxpr(function)(example)
    places: dict[tuple[Any, ...], int] = {}
    gathered: list[np.ndarray] = []
    for value in () if _calls_back(closed) else _constants(closed):
        key = _key(value, example.dtype)
        if key is not None and key not in places:
            places[key] = sum(part.size for part in gathered)
            gathered.append(np.ravel(np.asarray(value)))

    def rewritten(values: Float[Array, " m"], constants: Float[Array, " n"]) -> Array:
        (result,) = _Reader(places, {}, constants).evaluate(closed, [values])
        return result

    return rewritten, np.concatenate([np.zeros(0), *gathered]).astype(example.dtype)


def _constants(closed: core.ClosedJaxpr) -> Iterator[Any]:
    yield from closed.consts
    for equation in closed.jaxpr.eqns:
        parts = _parts(equation)
        if parts:
            yield from (atom.val for atom in equation.invars if isinstance(atom, core.Literal))
        for part in parts:
            yield from _constants(part)


def _calls_back(closed: core.ClosedJaxpr) -> bool:
    return any(
        equation.primitive.name == _CALLBACK or any(map(_calls_back, _parts(equation)))
        for equation in closed.jaxpr.eqns
    )


def _parts(equation: core.JaxprEqn) -> list[core.ClosedJaxpr]:
    """Functions that an operation is made of."""
    found = [item if isinstance(item, tuple) else (item,) for item in equation.params.values()]
    return [part for several in found for part in several if isinstance(part, core.ClosedJaxpr)]


def _key(value: Any, dtype: np.dtype) -> tuple[Any, ...] | None:
    """What equal constants share; None for what is not one to be gathered."""
    if isinstance(value, jax.core.Tracer) or np.size(value) > _LARGEST:
        return None
    if jnp.result_type(value) != dtype:
        return None
    return np.shape(value), np.asarray(value).tobytes()


class _Reader:
    """Evaluates what JAX has traced, with constants from an array.

    Parameters
    ----------
    places : where each constant begins in the array.
    compiled : functions compiled within, by the identity of what JAX has traced of them.
    constants : the array, as the function around sees it.
    """

    def __init__(
        self, places: dict[tuple[Any, ...], int], compiled: dict[int, Any], constants: Array
    ) -> None:
        self._places, self._compiled, self._constants = places, compiled, constants

    def evaluate(self, closed: core.ClosedJaxpr, arguments: Sequence[Any]) -> list[Any]:
        known = dict(zip(closed.jaxpr.constvars, map(self._read, closed.consts), strict=True))
        known.update(zip(closed.jaxpr.invars, arguments, strict=True))
        for equation in closed.jaxpr.eqns:
            read = self._read if _parts(equation) else _as_it_is
            given = [read(a.val) if isinstance(a, core.Literal) else known[a] for a in equation.invars]
            known.update(zip(equation.outvars, self._apply(equation, given), strict=True))
        return [a.val if isinstance(a, core.Literal) else known[a] for a in closed.jaxpr.outvars]

    def _read(self, value: Any) -> Any:
        key = _key(value, self._constants.dtype)
        if key not in self._places:
            return value
        first, shape = self._places[key], np.shape(value)
        return self._constants[first : first + np.size(value)].reshape(shape)

    def _apply(self, equation: core.JaxprEqn, given: list[Any]) -> Sequence[Any]:
        name, params = equation.primitive.name, equation.params
        if name == "jit":
            return self._function(params["jaxpr"], params["name"])(self._constants, *given)
        if name in _RULED:
            return self.evaluate(params[_RULED[name]], given)
        if name == "cond":
            index, *operands = given
            branches = [lambda *o, part=part: self.evaluate(part, o) for part in params["branches"]]
            return jax.lax.switch(index, branches, *operands)
        if name == "while":
            first, second = params["cond_nconsts"], params["cond_nconsts"] + params["body_nconsts"]
            ahead, within, carry = given[:first], given[first:second], given[second:]
            return jax.lax.while_loop(
                lambda carry: self.evaluate(params["cond_jaxpr"], [*ahead, *carry])[0],
                lambda carry: self.evaluate(params["body_jaxpr"], [*within, *carry]),
                carry,
            )
        if name == "scan":
            return self._scan(params, given)
        # Whatever else is made of functions keeps its constants.
        found = equation.primitive.bind(*given, **params)
        return found if equation.primitive.multiple_results else [found]

    def _scan(self, params: dict[str, Any], given: list[Any]) -> list[Any]:
        fixed, carried = params["num_consts"], params["num_carry"]
        within, carry, over = given[:fixed], given[fixed : fixed + carried], given[fixed + carried :]

        def body(carry: list[Any], over: list[Any]) -> tuple[list[Any], list[Any]]:
            found = self.evaluate(params["jaxpr"], [*within, *carry, *over])
            return found[:carried], found[carried:]

        end, each = jax.lax.scan(body, carry, over, params["length"], params["reverse"], params["unroll"])
        return [*end, *each]

    def _function(self, closed: core.ClosedJaxpr, name: str) -> Callable[..., list[Any]]:
        """Compiled as it was: what it shares is computed once, and wherever it is called is one function."""
        if id(closed) not in self._compiled:

            def function(constants: Array, *arguments: Any) -> list[Any]:
                return _Reader(self._places, self._compiled, constants).evaluate(closed, arguments)

            function.__name__ = name
            self._compiled[id(closed)] = jax.jit(function)
        found: Callable[..., list[Any]] = self._compiled[id(closed)]
        return found


def _as_it_is(value: Any) -> Any:
    return value
