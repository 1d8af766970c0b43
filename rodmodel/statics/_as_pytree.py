"""Plain dataclasses as trees of JAX."""

from collections.abc import Iterable
from dataclasses import fields
from typing import Any

from jax.tree_util import GetAttrKey, register_pytree_with_keys


def register(kind: type) -> None:
    """Let JAX take a frozen dataclass apart and build it again.

    JAX builds trees of axes, marks and tangents too, so what its `__post_init__` refuses in a number that
    somebody gave is not looked for.
    """
    names = tuple(field.name for field in fields(kind))

    def take_apart(whole: Any) -> tuple[list[tuple[GetAttrKey, Any]], None]:
        return [(GetAttrKey(name), getattr(whole, name)) for name in names], None

    def build(_: None, values: Iterable[Any]) -> Any:
        whole: Any = object.__new__(kind)
        vars(whole).update(zip(names, values, strict=True))
        return whole

    register_pytree_with_keys(kind, take_apart, build)
