"""Registration of plain dataclasses as pytrees of JAX."""

from collections.abc import Iterable
from dataclasses import fields
from typing import Any

from jax.tree_util import GetAttrKey, register_pytree_with_keys


def register(kind: type) -> None:
    """Register a frozen dataclass as a pytree whose leaves are its fields.

    JAX also builds such trees of axes, sentinels and tangents, so `__post_init__` with its checks of numbers
    is not called.
    """
    names = tuple(field.name for field in fields(kind))

    def flatten(instance: Any) -> tuple[list[tuple[GetAttrKey, Any]], None]:
        return [(GetAttrKey(name), getattr(instance, name)) for name in names], None

    def unflatten(_: None, values: Iterable[Any]) -> Any:
        instance: Any = object.__new__(kind)
        vars(instance).update(zip(names, values, strict=True))
        return instance

    register_pytree_with_keys(kind, flatten, unflatten)
