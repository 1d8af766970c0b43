"""Faults are real ones: each is another program, and none touches what holds no equation."""

import ast

from tests.mutation.mutants import mutants, sample
from tests.mutation.sandbox import ROOT
from tests.mutation.subjects import SUBJECTS

SOURCE = '''
@decorated(1)
def moment(r: Array["3", 7], n: float = 2) -> Array["3", 8]:
    """Moment − of a force."""
    if n < 0.0:
        raise ValueError(f"n: got {n - 1}")
    return -A @ jnp.cross(r[:3], n * r[2]).T + jnp.minimum(n, 0.5)
'''


def faults() -> set[tuple[str, str]]:
    return {(mutant.old, mutant.new) for mutant in mutants(SOURCE)}


def test_each_kind_of_fault_is_made() -> None:
    assert faults() >= {
        ("2", "3"),  # the argument's default
        ("n < 0.0", "n <= 0.0"),
        ("n < 0.0", "n >= 0.0"),
        ("-A", "A"),
        ("n * r[2]", "n / r[2]"),
        ("2", "1"),  # an index
        (":3", ":"),
        ("jnp.cross(r[:3], n * r[2])", "jnp.cross(n * r[2], r[:3])"),
        ("jnp.cross(r[:3], n * r[2]).T", "jnp.cross(r[:3], n * r[2])"),
        ("jnp.minimum(n, 0.5)", "jnp.maximum(n, 0.5)"),
        ("0.5", "1.0"),
    }


def test_annotations_decorators_docstrings_and_messages_stay() -> None:
    numbers = {old for old, _ in faults()}
    assert numbers.isdisjoint({"1", "7", "8", "n - 1"})
    for mutant in mutants(SOURCE):
        assert "Moment − of a force." in mutant.source


def test_every_mutant_of_a_subject_is_a_program_of_its_own() -> None:
    for subject in SUBJECTS.values():
        source = (ROOT / subject.module).read_text()
        made = mutants(source)
        assert len({source, *(mutant.source for mutant in made)}) == len(made) + 1 > 30
        assert len({mutant.key for mutant in made}) == len(made)
        for mutant in sample(made, 20):
            ast.parse(mutant.source)


def test_a_fault_is_where_its_line_says_and_nowhere_else() -> None:
    for mutant in mutants(SOURCE):
        pairs = enumerate(zip(SOURCE.splitlines(), mutant.source.splitlines(), strict=True), start=1)
        assert [number for number, (before, after) in pairs if before != after] == [mutant.line]
        assert ast.dump(ast.parse(mutant.source)) != ast.dump(ast.parse(SOURCE))


def test_a_larger_sample_holds_a_smaller_one_in_the_order_of_lines() -> None:
    population = mutants((ROOT / SUBJECTS["ridge-law"].module).read_text())
    small, large = sample(population, 5), sample(population, 12)
    assert len(small) == 5 < len(large) == 12
    assert set(small) < set(large)
    assert [mutant.line for mutant in large] == sorted(mutant.line for mutant in large)
    assert sample(population, len(population) + 1) == population


def test_a_subject_names_files_that_are_there() -> None:
    for subject in SUBJECTS.values():
        for name in (subject.module, *subject.tests):
            assert (ROOT / name.partition("::")[0]).exists(), name
