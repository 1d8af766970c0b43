"""JSON schema of a design file, for editors that check and complete TOML."""

import json
from importlib.resources import files
from typing import Any

from fem_reference.design.tables import TABLES, Key, Table

_DRAFT = "https://json-schema.org/draft/2020-12/schema"
_FILE = "design.schema.json"
# By table, the combinations of keys of which one is needed, beside the keys that are needed always.
_ONE_OF = {
    "material": ("name", "model", "test"),
    "thread": ("name", "young_modulus_mpa"),
}


def design_schema() -> dict[str, Any]:
    """Return the schema that ships with the package (JSON Schema, draft 2020-12).

    It knows keys, kinds and ranges. Whether parts fit each other, `read_design` says.
    """
    schema: dict[str, Any] = json.loads(files("fem_reference.design").joinpath(_FILE).read_text("utf-8"))
    return schema


def schema_of_tables() -> dict[str, Any]:
    """Return the schema that the reader's table of keys stands for, which the shipped file holds.

    ``python -m tests.unit.fem_reference.design.schema_file`` writes that file.
    """
    top, *tables = TABLES
    whole = _object(top)
    whole["properties"] |= {table.name: _object(table) for table in tables}
    whole["required"] += [table.name for table in tables if not table.optional]
    return {"$schema": _DRAFT, "title": "Design of a soft pneumatic actuator", **whole}


def _object(table: Table) -> dict[str, Any]:
    made: dict[str, Any] = {
        "type": "object",
        "description": table.meaning,
        "properties": {key.name: _value(key) for key in table.keys},
        "required": [key.name for key in table.keys if not key.optional],
        "additionalProperties": False,
    }
    if table.name in _ONE_OF:
        made["oneOf"] = [{"required": [name]} for name in _ONE_OF[table.name]]
    return made


def _value(key: Key) -> dict[str, Any]:
    return {"description": f"{key.meaning[:1].upper()}{key.meaning[1:]}.", **key.kind.schema}
