"""A rod as C constants: `law.h` and `law.c`."""

import json
import math
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from rodmodel.core._handle import ENDS, IN_PLACE, bound_numbers, domain_numbers
from rodmodel.core._law_data import LawData, law_data

if TYPE_CHECKING:
    from rodmodel.actuator import Actuator, Domain
    from rodmodel.error_bound import ErrorBound
    from rodmodel.io import Calibration, Found, SnappedSheet

_WIDTH = 118


def law_header(found: "Found") -> str:
    """Return `law.h`: a description of the rod, its provenance, sizes and declarations."""
    laws = [_law(found), *(_sheet_law(sheet) for sheet in _sheets(found))]
    sizes = {name: max(law.sizes[name] for law in laws) for name in laws[0].sizes}
    lines = [
        f"/*\n{_comment(found)}\n */",
        "#ifndef LAW_H",
        "#define LAW_H",
        "",
        '#include "rodmodel_core.h"',
        "",
        "#ifdef __cplusplus",
        'extern "C" {',
        "#endif",
        "",
        *(f"#define ROD_{name.upper()} {size}" for name, size in sizes.items()),
        "",
        "/* Size of a workspace [rm_real] for so many steps, with or without a Jacobian and the inverse: a",
        " * constant. */",
        "#define ROD_WORKSPACE_SIZE(steps, with_jacobian) \\",
        "    RM_WORKSPACE_SIZE(ROD_IMAGES, ROD_RIDGES, ROD_FEATURES, steps, with_jacobian)",
        "",
        "extern const rm_rod rod;",
    ]
    if _is_oriented(found):
        lines += [
            "",
            "/* Orientation psi of the rod [rad]. */",
            f"#define ROD_PSI {_number(found.psi)}",
            "",
            "/* Laws of all orientations, and the rod at one of them. `memory` holds ROD_ORIENT_SIZE numbers",
            " * and must live as long as that rod. */",
            "#define ROD_ORIENT_SIZE (2 * ROD_IMAGES * ROD_FEATURES)",
            "extern const rm_oriented rods;",
            "void rod_at_psi(rm_real psi, rm_real *memory, rm_rod *found);",
        ]
    if len(laws) > 1:
        lines += [
            "",
            "/* All branches of the rod; the first is `rod`. */",
            f"#define ROD_BRANCHES {len(laws)}",
            "extern const rm_branches branches;",
        ]
    return "\n".join([*lines, "", "#ifdef __cplusplus", "}", "#endif", "", "#endif", ""])


def law_source(found: "Found") -> str:
    """Return `law.c`: the arrays and the rod, and the laws of a calibration of all orientations."""
    law = _law(found)
    oriented = law_data(found.calibration.law).orientation if _is_oriented(found) else {}
    lines = [
        "/* Numbers of law.h, written by `rodmodel export`; rodmodel_core.h describes each of them. */",
        "#include <math.h>",
        "",
        '#include "law.h"',
        "",
        "#define N(x) ((rm_real)(x))",
        "",
        "#define ACTUATOR \\",
        *_continued(_ends(found.calibration.actuator)),
        "",
        *(_array(name, array) for name, array in oriented.items()),
        *_rod("const rm_rod rod", law, "", found.domain, found.calibration.error_bound),
    ]
    if oriented:
        own = dict.fromkeys(("feature_biases", "rest_features"), "NULL")
        lines += [
            "",
            "const rm_oriented rods = {",
            "    .law = {",
            *_law_fields(law, "", own),
            "    },",
            *(f"    .{name} = {name}," for name in oriented),
            "};",
            "",
            "void rod_at_psi(rm_real psi, rm_real *memory, rm_rod *found)",
            "{",
            "    *found = rod;",
            "    rm_orient(&rods, psi, memory, &found->law);",
            "}",
        ]
    if sheets := _sheets(found):
        lines += ["", *_branches(sheets)]
    return "\n".join([*lines, ""])


def _rod(
    name: str, law: LawData, prefix: str, domain: "Domain", bound: "ErrorBound", actuator: str = "ACTUATOR"
) -> list[str]:
    """Return the arrays and the initialiser of an `rm_rod`; `actuator` is the macro of its ends."""
    pointed_to = {name: array for name, array in law.arrays.items() if name not in IN_PLACE}
    return [
        *(_array(f"{prefix}{name}", array) for name, array in pointed_to.items()),
        f"static const int {prefix}orders[] = {{{', '.join(str(k) for k in law.orders.ravel())}}};",
        "",
        f"{name} = {{",
        "    .law = {",
        *_law_fields(law, prefix, {}),
        "    },",
        f"    .actuator = {actuator},",
        "    .domain = {",
        *_items(_fields(domain_numbers(domain))),
        "    },",
        "    .error_bound = {",
        *_items(_fields(bound_numbers(bound))),
        "    },",
        "};",
    ]


def _branches(sheets: "tuple[SnappedSheet, ...]") -> list[str]:
    """Return the rods of the snapped branches, and all branches after the loading one."""
    names = [f"snapped_{sheet.chamber}_{'larger' if sheet.side > 0 else 'smaller'}" for sheet in sheets]
    ends = "SNAPPED_ACTUATOR"
    lines = [f"#define {ends} \\", *_continued(_ends(sheets[0].actuator)), ""]
    for name, sheet in zip(names, sheets, strict=True):
        declared = f"static const rm_rod {name}"
        lines += [*_rod(declared, _sheet_law(sheet), f"{name}_", sheet.domain, sheet.bound, ends), ""]
    rods = ", ".join(f"&{name}" for name in ("rod", *names))
    chambers = ", ".join(str(k) for k in (0, *(sheet.chamber for sheet in sheets)))
    sides = ", ".join(str(k) for k in (0, *(sheet.side for sheet in sheets)))
    return [
        *lines,
        f"static const rm_rod *const branch_rods[] = {{{rods}}};",
        f"static const int branch_chambers[] = {{{chambers}}};",
        f"static const int branch_sides[] = {{{sides}}};",
        "",
        "const rm_branches branches = {",
        f"    .count = {len(names) + 1},",
        "    .rods = branch_rods,",
        "    .chambers = branch_chambers,",
        "    .sides = branch_sides,",
        "};",
    ]


def _sheets(found: "Found") -> "tuple[SnappedSheet, ...]":
    from rodmodel.io import snapped_sheets

    return snapped_sheets(found)


def _sheet_law(sheet: "SnappedSheet") -> LawData:
    return law_data(sheet.law.law, sheet.turns, sheet.mirrored)


def _is_oriented(found: "Found") -> bool:
    return found.calibration.law.orientation_weights is not None


def _law(found: "Found") -> LawData:
    return law_data(found.calibration.law, found.turns, found.mirrored, found.psi)


def _law_fields(law: LawData, prefix: str, others: dict[str, str]) -> list[str]:
    """Return the initialiser of `rm_law`; its arrays have a prefix, or the names in `others`."""
    fields = {name: str(size) for name, size in law.sizes.items()}
    fields |= {name: _real(value) for name, value in law.numbers.items()}
    for name, array in law.arrays.items():
        if name in IN_PLACE:
            fields[name] = "{" + ", ".join(_real(x) for x in array.ravel()) + "}"
        else:
            fields[name] = others.get(name, f"{prefix}{name}")
    fields["orders"] = f"{prefix}orders"
    lines = [f".{name} = {value}," for name, value in fields.items()]
    return [textwrap.fill(line, _WIDTH, initial_indent=" " * 8, subsequent_indent=" " * 12) for line in lines]


def _ends(actuator: "Actuator") -> dict[str, str]:
    return {name: _real(float(getattr(actuator, name))) for name in ENDS}


def _fields(numbers: dict[str, Any]) -> dict[str, str]:
    return {
        name: _real(value) if isinstance(value, float) else "{" + ", ".join(map(_real, value)) + "}"
        for name, value in numbers.items()
    }


def _items(fields: dict[str, str]) -> list[str]:
    """Return the lines of a structure's initialiser."""
    return [f"        .{name} = {value}," for name, value in fields.items()]


def _continued(fields: dict[str, str]) -> list[str]:
    """Return the initialiser of a structure as lines of a macro."""
    items = [f".{name} = {value}" for name, value in fields.items()]
    return ["    { \\", *(f"        {item}, \\" for item in items), "    }"]


def _array(name: str, array: np.ndarray) -> str:
    numbers = textwrap.fill(
        ", ".join(_real(x) for x in array.ravel()),
        _WIDTH,
        initial_indent="    ",
        subsequent_indent="    ",
        break_on_hyphens=False,
        break_long_words=False,
    )
    return f"static const rm_real {name}[] = {{\n{numbers}\n}};\n"


def _real(x: float) -> str:
    """Return a constant of either precision; the cast makes the rounding to single precision explicit."""
    return f"N({_number(x)})"


def _number(x: float) -> str:
    """Return a floating constant of C with 17 significant digits, which determine the double."""
    if math.isnan(x):
        return "NAN"
    text = f"{float(x):.17g}"
    return text if "." in text or "e" in text else text + ".0"


def _comment(found: "Found") -> str:
    """Return comment lines that describe the rod: layout, domain, error, units, provenance."""
    from rodmodel.io import calibration_record, calibration_text

    calibration = found.calibration
    record = calibration_record(calibration)
    paragraphs = [
        f"The rod of a soft pneumatic actuator: {calibration.layout.name}, "
        f"psi {math.degrees(found.psi):.10g} deg, "
        f"pitch {1e3 * calibration.layout.pitch:.10g} mm.",
        "Units are SI: m, N, Pa, rad. Numbers have 17 significant digits.",
        *(line.strip() for line in calibration_text(record).split("\n")[1:]),
        _accuracy(calibration),
        "Chambers above are numbered as in the calibration; rod.domain has this rod's numbers.",
        "Where the calibration comes from:",
        *_provenance(calibration.provenance),
    ]
    lines = [
        line
        for text in paragraphs
        for line in textwrap.wrap(_harmless(text), _WIDTH - 3, break_on_hyphens=False)
    ]
    return "\n".join(f" * {line}" for line in lines)


def _accuracy(calibration: "Calibration") -> str:
    """Return what the bound says of a rod that is nearly straight, and of one far bent, without loads."""
    bound, most = calibration.error_bound, calibration.domain.pressure_sum_max
    (angle, tip), (last_angle, last_tip) = bound.at(0.0, bending_angle=0.0), bound.at(most)
    text = (
        "The bending angle of 90 % of states is within "
        f"{math.degrees(angle):.2g} deg of the data it was calibrated to where the rod is nearly straight, "
        f"and within {math.degrees(last_angle):.2g} deg at half a turn and {1e-3 * most:g} kPa in sum"
    )
    if math.isnan(tip):
        return f"{text}; nothing is known of the tip."
    return f"{text}; the tip within {1e3 * tip:.2g} and {1e3 * last_tip:.2g} mm. Loads add to both."


def _provenance(provenance: Any) -> list[str]:
    return [f"{key}: {json.dumps(value)}" for key, value in provenance.items()]


def _harmless(text: str) -> str:
    """Return ASCII text that neither ends nor begins a comment and has no trigraph."""
    plain = json.dumps(text)[1:-1].replace('\\"', '"')
    for pair in ("*/", "/*", "??"):
        plain = plain.replace(pair, " ".join(pair))
    return plain
