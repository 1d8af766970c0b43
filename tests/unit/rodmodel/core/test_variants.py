"""Copies of the core for several instruction sets: which of them a machine runs, and that each is whole."""

import importlib.util
import re
from pathlib import Path

import pytest

from rodmodel.core._native import lib
from rodmodel.core._variants import VARIANTS, functions

CORE = Path(__file__).parents[4] / "rodmodel" / "core"
CPUINFO = Path("/proc/cpuinfo")
NEEDED = {
    "baseline": set(),
    "avx2": {"avx", "avx2", "fma"},
    "avx512": {"avx", "avx2", "fma", "avx512f", "avx512dq", "avx512vl", "avx512bw"},
}


def builder():
    """Return the module that writes the extension's source; it is no part of an installed package."""
    spec = importlib.util.spec_from_file_location("core_build", CORE / "_build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.skipif(not CPUINFO.exists(), reason="the kernel does not list the processor's features")
def test_variants_are_those_whose_instructions_the_kernel_lists():
    found = re.search(r"^flags\s*:(.*)$", CPUINFO.read_text(), re.MULTILINE)
    features = set(found[1].split()) if found else set()
    assert (
        tuple(name for name, needed in NEEDED.items() if needed <= features or name == "baseline") == VARIANTS
    )


def test_each_variant_has_every_function_of_the_header():
    without_comments = re.sub(r"/\*.*?\*/", "", (CORE / "src/rodmodel_core.h").read_text(), flags=re.DOTALL)
    declared = set(re.findall(r"\b(rm_\w+)\(", without_comments))
    assert "rm_solve" in declared
    for variant in VARIANTS:
        assert set(vars(functions(variant))) == declared


def test_functions_are_those_of_the_variant():
    for variant in VARIANTS:
        assert functions(variant).rm_solve is getattr(lib, f"rm_solve_{variant}")
    assert functions().rm_solve is getattr(lib, f"rm_solve_{VARIANTS[-1]}")


def test_a_variant_that_the_machine_does_not_run_is_refused():
    with pytest.raises(ValueError, match="variant: got 'sse9', expected one of baseline"):
        functions("sse9")


def test_a_header_without_marks_is_refused(tmp_path):
    (tmp_path / "plain.h").write_text("int f(void);\n")
    with pytest.raises(ValueError, match=r"plain\.h: got no part between"):
        builder().declarations(tmp_path / "plain.h")


def test_only_functions_get_the_name_of_a_variant():
    struct = "typedef struct {\n    int rm_solve;\n} rm_solve_state;"
    function = "int rm_solve{}(const rm_solve_state *state,\n    int n);"
    types, copies = builder().for_variants(f"{struct}\n{function.format('')}\n", ["a", "b"])
    assert types.strip() == struct
    assert copies == function.format("_a") + "\n" + function.format("_b")
