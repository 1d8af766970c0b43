"""A design as the text of its file, in canonical form."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from fem_reference.design.design import Design
from fem_reference.design.material_table import material_arguments
from fem_reference.design.tables import TABLES
from fem_reference.geometry import NoWinding


def design_text(design: Design) -> str:
    """Return the TOML text of a design: all keys in the order of the reference, defaults too.

    `parse_design` makes the same design of it. Equal designs have equal texts, so that a text stands for a
    design in provenance. A material or a thread that came by its name is written by its constants.
    """
    blocks = []
    for table in TABLES:
        values = _arguments(design)[table.name]
        lines = [
            f"{key.name} = {key.kind.write(values[key.argument])}"
            for key in table.keys
            if values.get(key.argument) is not None
        ]
        if lines:
            blocks.append("\n".join([*([f"[{table.name}]"] if table.name else []), *lines]))
    return "\n\n".join(blocks) + "\n"


def _arguments(design: Design) -> Mapping[str, Mapping[str, Any]]:
    """Return values in SI by table and argument; None for what the file leaves out."""
    wound = not isinstance(design.winding, NoWinding)
    return {
        "": {"name": design.name},
        "dimensions": asdict(design.geometry),
        "material": {
            **material_arguments(design.material),
            "material_source": design.material_source or None,
            "density": design.density,
        },
        "core": asdict(design.core),
        "thread": asdict(design.thread) if wound else {},
        "winding": {"layout": design.winding.name, **asdict(design.winding)},
        "ends": {
            "bonded": design.bonded,
            "cap_wound": design.cap_wound,
            "end_compliance": design.end_compliance,
        },
        "pressures": {"pressure_max": design.pressure_max, "pressure_sum_max": design.pressure_sum_max},
    }
