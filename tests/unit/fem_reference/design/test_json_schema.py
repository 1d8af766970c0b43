"""The schema that ships is that of the reader's table, and takes what the reader takes."""

import copy
import json
import tomllib

import jsonschema
import pytest

from fem_reference.design import Design, DesignError, design_schema, parse_design
from fem_reference.design.tables import TABLES
from fem_reference.design.write import design_text
from tests.unit.fem_reference.design.schema_file import FILE, ROOT, schema_text

DESIGNS = sorted((ROOT / "designs").glob("*.toml"))
VALIDATOR = jsonschema.Draft202012Validator(design_schema())


def test_the_file_is_the_tables():
    assert FILE.read_text() == schema_text()
    jsonschema.Draft202012Validator.check_schema(json.loads(schema_text()))


def test_designs_are_there():
    assert {"paper", "half", "ecoflex20"} <= {file.stem for file in DESIGNS}


@pytest.mark.parametrize("file", DESIGNS, ids=lambda file: file.stem)
def test_the_designs_that_ship_match_it(file):
    VALIDATOR.validate(tomllib.loads(file.read_text()))


def test_a_canonical_text_matches_it():
    VALIDATOR.validate(tomllib.loads(design_text(Design(pressure_max=(1e4, 2e4, 3e4), pressure_sum_max=5e4))))


def changes():
    """For each key, a content with it missing, and with values of other kinds."""
    whole = tomllib.loads(design_text(Design(end_compliance=1e-4)))
    for table in TABLES:
        for key in table.keys:
            inside = whole if not table.name else whole.get(table.name, {})
            if key.name not in inside:
                continue
            for what, value in (("missing", None), ("a sentence", "1979 years"), ("lists", [[]])):
                content = copy.deepcopy(whole)
                place = content if not table.name else content[table.name]
                if value is None:
                    del place[key.name]
                else:
                    place[key.name] = value
                yield pytest.param(content, id=f"{table.name}.{key.name} {what}")


@pytest.mark.parametrize("content", list(changes()))
def test_reader_and_schema_agree_on_keys_and_kinds(content):
    """But for what only the reader knows: which keys go together."""
    text = _toml(content)
    try:
        parse_design(text)
    except DesignError as error:
        told = {fault.message for fault in error.faults}
        of_parts = all("the model" in m or "the layout" in m or "name of a thread" in m for m in told)
        assert of_parts or not VALIDATOR.is_valid(content)
    else:
        assert VALIDATOR.is_valid(content)


def _toml(content) -> str:
    top = [f"{key} = {json.dumps(value)}" for key, value in content.items() if not isinstance(value, dict)]
    for name, table in content.items():
        if isinstance(table, dict):
            top += [f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in table.items())]
    return "\n".join(top) + "\n"
