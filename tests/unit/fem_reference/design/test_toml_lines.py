"""Every key of a TOML text is found with its line, as `tomllib` reads it."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem_reference.design.toml_lines import key_lines, repeated, toml_entries

TEXT = '''# a comment with [a table] and key = 1
name = "a # no comment" # a comment

[one] # header
list = [
  1, # one
  [2, 3], "]",
]
after = 1
text = """
[not a table]
no = "key"
"""
raw = \'\'\'
[nor this]\'\'\'
"quoted key" = 1
dotted.inner = 2
[one.two]
inline = {a = 1, b = {c = [
  1]}, d = 2}
last = 'x'
[[many]]
k = 1979-05-27T07:32:00Z
'''


def paths(content, before=()):
    """Paths of all keys of a content, tables within lists among them."""
    found = set()
    if isinstance(content, dict):
        for key, value in content.items():
            found |= {(*before, key)} | paths(value, (*before, key))
    elif isinstance(content, list):
        for one in content:
            found |= paths(one, before)
    return found


def test_lines_are_those_of_the_text():
    lines = key_lines(TEXT)
    assert lines == {
        ("name",): 2,
        ("one",): 4,
        ("one", "list"): 5,
        ("one", "after"): 9,
        ("one", "text"): 10,
        ("one", "raw"): 14,
        ("one", "quoted key"): 16,
        ("one", "dotted", "inner"): 17,
        ("one", "two"): 18,
        ("one", "two", "inline"): 19,
        ("one", "two", "inline", "a"): 19,
        ("one", "two", "inline", "b"): 19,
        ("one", "two", "inline", "b", "c"): 19,
        ("one", "two", "inline", "d"): 20,
        ("one", "two", "last"): 21,
        ("many",): 22,
        ("many", "k"): 23,
    }


def test_every_key_that_tomllib_reads_is_found():
    # A dotted key makes a table that has no line of its own.
    assert paths(tomllib.loads(TEXT)) - set(key_lines(TEXT)) == {("one", "dotted")}


words = st.text("abcXYZ019_-", min_size=1, max_size=6)
scalars = st.one_of(
    st.integers(-99, 99).map(str),
    st.floats(-9.0, 9.0).map(repr),
    st.sampled_from(
        ["true", '"a = [b] # c"', "'lit # {'", '"""x\n[y]\nz = 1"""', "'''\nq = 2\n'''", '"\\"]"']
    ),
)
values = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3).map(lambda parts: "[\n" + ",\n ".join(parts) + " # end, [\n]"),
        st.dictionaries(words, scalars.filter(lambda v: "\n" not in v), max_size=3).map(
            lambda table: "{" + ", ".join(f"{key} = {value}" for key, value in table.items()) + "}"
        ),
    ),
    max_leaves=6,
)


@given(st.dictionaries(words, st.dictionaries(words, values, max_size=4), max_size=4))
def test_any_text_has_its_keys_on_their_lines(tables):
    text, expected = "", {}
    for name, keys in tables.items():
        expected[(name,)] = text.count("\n") + 1
        text += f"[{name}]\n"
        for key, value in keys.items():
            expected[name, key] = text.count("\n") + 1
            text += f"{key} = {value} # comment\n"
    content = tomllib.loads(text)
    found = key_lines(text)
    assert expected.items() <= found.items()
    assert set(found) == paths(content)


@pytest.mark.parametrize(
    ("text", "twice"),
    [
        ("a = 1\nb = 2\na = 3\n", [(("a",), 1, 3)]),
        ("[t]\nx = [\n1]\n[u]\n[t]\ny = 1\n", [(("t",), 1, 5)]),
        ("[t]\nx = 1\n\nx = 2\n", [(("t", "x"), 2, 4)]),
        ("[t]\nx = 1\n[u]\nx = 2\n", []),
    ],
)
def test_what_stands_twice_is_found(text, twice):
    assert repeated(text) == twice


@pytest.mark.parametrize("end", ["[t", "k", "k =", "k = [1, 2", 'k = "open', "k = {a = 1", "= 3", "]"])
def test_entries_of_a_faulty_text_end_where_it_does(end):
    entries = toml_entries(f"a = 1\n[b]\nc = 2\n{end}\n")
    assert [entry.path for entry in entries[:3]] == [("a",), ("b",), ("b", "c")]
    assert all(entry.line == 4 for entry in entries[3:])
