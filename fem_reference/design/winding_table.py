"""The [winding] and [thread] tables of a design file, and what they stand for."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from fem_reference.design.kinds import KeysError
from fem_reference.geometry import THREADS, NoWinding, Ring, Thread, Winding, layout

# Arguments of each layout that are needed, and those that may be given.
_HELIX = (("pitch",), ("psi", "pitch"))
_ARGUMENTS = {Ring.name: (("spacing",), ("spacing",)), NoWinding.name: ((), ())}


def winding_of(given: Mapping[str, Any]) -> Winding:
    """Return the winding of a table's values in SI, by argument.

    Raises
    ------
    KeysError
        For keys that the layout does not have or lacks.
    ValueError
        From the winding itself, with the name of its argument.
    """
    name = given["layout"]
    needed, may = _ARGUMENTS.get(name, _HELIX)
    for argument in ("psi", "pitch", "spacing"):
        if argument in given and argument not in may:
            raise KeysError((argument,), f"got it for the layout {name}, expected it without")
        if argument in needed and argument not in given:
            raise KeysError((argument,), f"got nothing, expected it for the layout {name}")
    psi = given.get("psi", 0.0)
    if name == NoWinding.name:
        return NoWinding()
    if name == Ring.name:
        return Ring(given["spacing"])
    return layout(name, psi, given["pitch"])


def thread_of(given: Mapping[str, Any]) -> Thread:
    """Return the thread of a table's values in SI, by argument.

    Raises
    ------
    KeysError
        For neither a name nor a modulus and a radius, or both a name and a modulus.
    ValueError
        From the thread itself, with the name of its argument.
    """
    own = {argument: value for argument, value in given.items() if argument != "thread_name"}
    if "thread_name" in given:
        if "young_modulus" in given:
            raise KeysError(("young_modulus",), "got it beside name, expected one of the two")
        return replace(THREADS[given["thread_name"]], **own)
    missing = tuple(argument for argument in ("young_modulus", "radius") if argument not in given)
    if missing:
        raise KeysError(missing, "got nothing, expected a number, or the name of a thread")
    return Thread(**own)
