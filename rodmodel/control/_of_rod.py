"""Conversion of a differentiable rod to a compiled one."""

from dataclasses import replace
from typing import Any

import numpy as np

from rodmodel.actuator import Actuator, Domain
from rodmodel.core import CoreRod, Handle, LawData, law_data, linear_law_data
from rodmodel.error_bound import ErrorBound


def core_of(rod: Any) -> CoreRod:
    """Return the compiled rod with the numbers of a rod, compiled or differentiable.

    Parameters
    ----------
    rod : a `CoreRod`, which is returned unchanged, or a `rodmodel.Rod` with concrete numbers: neither traced
        by JAX nor a stack.

    Raises
    ------
    ValueError
        For a section law of a kind that the core does not have.
    """
    if isinstance(rod, CoreRod):
        return rod
    actuator, domain = _floats(Actuator, rod.actuator), _floats(Domain, rod.domain)
    bound = _floats(ErrorBound, rod.error_bound)
    return CoreRod(Handle(_law_of(rod.section), actuator, domain, bound), actuator, domain, bound)


def _law_of(section: Any) -> LawData:
    # Imported late, as it imports JAX; a rod with such a law has done so already.
    from rodmodel.section import LinearLaw, MirroredLaw, RidgeNetwork, TurnedLaw, arrays_of

    turns, mirrored, law = 0, False, section
    if isinstance(law, TurnedLaw):
        turns, law = law.turns, law.law
    if isinstance(law, MirroredLaw):
        mirrored, law = True, law.law
    if isinstance(law, LinearLaw) and not (turns or mirrored):
        return linear_law_data(
            np.asarray(law.section_stiffness), np.asarray(law.curvature_by_pressure), float(law.rest_volume)
        )
    if not isinstance(law, RidgeNetwork):
        raise ValueError(
            f"rod: got a section law {type(section).__name__}, expected a LinearLaw, or a RidgeNetwork, "
            "which may be mirrored and then turned"
        )
    # A law taken from a law of all orientations has biases for each image.
    shared = replace(law, feature_biases=law.feature_biases[0]) if law.feature_biases.ndim == 2 else law
    return law_data(arrays_of(shared), turns, mirrored, biases=np.asarray(law.feature_biases))


def _floats(kind: Any, numbers: Any) -> Any:
    def number(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(number, value))
        return None if value is None else float(value)

    return kind(**{name: number(getattr(numbers, name)) for name in kind.__dataclass_fields__})
