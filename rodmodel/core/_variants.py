"""The core's functions, compiled for the instruction sets of this machine."""

from types import SimpleNamespace

from rodmodel.core._native import lib

# Variants that this machine runs, the fastest last, in the order of `enum rm_variant`.
VARIANTS = ("baseline", "avx2", "avx512")[: lib.rm_best_variant() + 1]


def functions(variant: str = VARIANTS[-1]) -> SimpleNamespace:
    """Return the core's public functions under their names in rodmodel_core.h.

    They are the extension's own functions, so a call has no overhead. Variants differ only in rounding.

    Parameters
    ----------
    variant : one of `VARIANTS`; the fastest if not given.

    Raises
    ------
    ValueError
        For a variant whose instructions this machine lacks.
    """
    if variant not in VARIANTS:
        raise ValueError(
            f"variant: got {variant!r}, expected one of {', '.join(VARIANTS)}; this machine runs no other"
        )
    ending = f"_{variant}"
    return SimpleNamespace(
        **{name.removesuffix(ending): getattr(lib, name) for name in dir(lib) if name.endswith(ending)}
    )
