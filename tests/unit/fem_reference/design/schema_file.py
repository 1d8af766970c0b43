"""Writes the JSON schema of a design file, which ships with the package.

``python -m tests.unit.fem_reference.design.schema_file``; `test_json_schema` holds it to the reader's table.
"""

import json
from pathlib import Path

from fem_reference.design.json_schema import schema_of_tables

ROOT = Path(__file__).parents[4]
FILE = ROOT / "fem_reference" / "design" / "design.schema.json"


def schema_text() -> str:
    """The file's text."""
    return json.dumps(schema_of_tables(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    FILE.write_text(schema_text())
