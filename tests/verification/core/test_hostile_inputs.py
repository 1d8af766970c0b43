"""Hostile inputs, under sanitizers: no report, no NaN in a success, failures flagged; see `hostile.c`."""

from pathlib import Path

import pytest

from tests.verification.core.toolchain import ANY, C99, CORE, HERE, OWN, build, compiler, exported, output

SANITIZERS = "-fsanitize=address,undefined,float-cast-overflow"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("psi_deg", "single_precision", "seed"), [(OWN, False, "1"), (OWN, True, "2"), (ANY, False, "3")]
)
def test_hostile_inputs_are_flagged_and_nothing_else_happens(
    tmp_path: Path, psi_deg: float, single_precision: bool, seed: str
):
    folder = exported(tmp_path / "rod", psi_deg, single_precision)
    flags = (*C99, "-g", "-O1", SANITIZERS, "-fno-sanitize-recover=all")
    program = build(folder, compiler("gcc"), *flags, sources=(HERE / "hostile.c", *CORE), out="hostile")
    assert output(program, "4000", seed) == "4000 cases, 0 failures\n"
