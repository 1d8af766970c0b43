"""Write the C source of the extension module `rodmodel.core._native`; CMake calls it at build time.

The module has every public function of the core once for each variant, `rm_solve_avx2` beside
`rm_solve_baseline`, so that the choice of a variant costs nothing in a call. Its declarations are the parts
of the headers between the lines `cffi: begin` and `cffi: end`.
"""

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

from cffi import FFI

_SOURCES = Path(__file__).parent / "src"
_MODULE = "rodmodel.core._native"


def declarations(header: Path) -> str:
    """Return the declarations of `header` for cffi, without comments."""
    _, begin, rest = header.read_text(encoding="utf-8").partition("/* cffi: begin */")
    part, end, _ = rest.partition("/* cffi: end */")
    if not (begin and end):
        raise ValueError(f"{header}: got no part between `cffi: begin` and `cffi: end`; mark one")
    return re.sub(r"/\*.*?\*/", "", part, flags=re.DOTALL)


def for_variants(declared: str, variants: Sequence[str]) -> tuple[str, str]:
    """Split declarations into types, and functions under their names in each of `variants`."""
    function = re.compile(r"^[a-z][\w \*]*?\b(rm_\w+)\([^()]*\);$", re.MULTILINE)
    names = function.findall(declared)
    prototypes = [found[0] for found in function.finditer(declared)]
    copies = [
        re.sub(rf"\b({'|'.join(names)})\(", rf"\1_{variant}(", prototype)
        for variant in variants
        for prototype in prototypes
    ]
    return function.sub("", declared), "\n".join(copies)


def write_source(target: Path, variants: Sequence[str]) -> None:
    """Write the module's C source to `target`, with the functions of these variants of the core."""
    types, functions = for_variants(declarations(_SOURCES / "rodmodel_core.h"), variants)
    ffi = FFI()
    ffi.cdef(f"typedef double rm_real;\n{types}\n{functions}\n{declarations(_SOURCES / 'dispatch.h')}")
    ffi.set_source(_MODULE, f'#include "rodmodel_core.h"\n#include "dispatch.h"\n{functions}\n')
    ffi.emit_c_code(str(target))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=write_source.__doc__)
    parser.add_argument("target", type=Path)
    parser.add_argument("variants", nargs="+")
    arguments = parser.parse_args()
    write_source(arguments.target, arguments.variants)
