"""The exported rod on a Cortex-M7 in QEMU: what it prints, and the memory that it takes.

`python -m tests.verification.core.microcontroller` prints the table of docs/reference/c_export.md.
"""

import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tests.verification.core.toolchain import CORE, HERE, build, exported, output

TOOLS = ("arm-none-eabi-gcc", "arm-none-eabi-size", "qemu-system-arm")
TARGET = ("-mcpu=cortex-m7", "-mthumb", "-mfloat-abi=hard")
UNITS = {False: "-mfpu=fpv5-d16", True: "-mfpu=fpv5-sp-d16"}
CODE = ("-std=c99", "-O2", "-fno-math-errno", "-ffp-contract=fast", "-ffunction-sections", "-fdata-sections")
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
LINK = ("--specs=rdimon.specs", "-nostartfiles", f"-T{HERE / 'mps2_an500.ld'}", "-Wl,--gc-sections")
MACHINE = ("-machine", "mps2-an500", "-semihosting", "-nographic", "-monitor", "none", "-serial", "none")


@dataclass(frozen=True)
class Footprint:
    """Bytes: of the core's code, of the law's constants, of stack and workspace by what is done."""

    code: int
    law: int
    stack: dict[str, int]
    workspace: dict[str, int]


def objects(folder: Path, single_precision: bool) -> tuple[str, ...]:
    """Files of the compiled core and law; both programs are linked with the same."""
    compiled = tuple(source.replace(".c", ".o") for source in CORE)
    for source, out in zip(CORE, compiled, strict=True):
        if not (folder / out).exists():
            flags = (*TARGET, UNITS[single_precision], *CODE, *WARNINGS, "-c")
            build(folder, [TOOLS[0]], *flags, sources=(source,), out=out)
    return compiled


def run(folder: Path, program: str, single_precision: bool) -> str:
    """Output of `example`, or of `footprint`, on the emulated processor."""
    source = folder / "main.c" if program == "example" else HERE / "footprint.c"
    flags = (*TARGET, UNITS[single_precision], *CODE, *WARNINGS, *LINK)
    sources = (HERE / "startup.c", source, *objects(folder, single_precision))
    image = build(folder, [TOOLS[0]], *flags, sources=sources, out=f"{program}.elf")
    return output([TOOLS[2], *MACHINE, "-kernel", str(image)])


def footprint(folder: Path, single_precision: bool) -> Footprint:
    """What the rod of an exported folder takes."""
    rows = dict(line.split() for line in run(folder, "footprint", single_precision).splitlines())
    assert rows["good"] == "1"
    sizes = []
    for compiled in objects(folder, single_precision):
        listed = output([TOOLS[1], compiled], cwd=folder).splitlines()[1].split()
        text, data, bss = (int(number) for number in listed[:3])
        # Constants and code alone: the core keeps no state.
        assert data == bss == 0
        sizes.append(text)
    by_name = {name: int(value) for name, value in rows.items()}
    return Footprint(
        *sizes,
        stack={name[6:]: value for name, value in by_name.items() if name.startswith("stack_")},
        workspace={name[10:]: value for name, value in by_name.items() if name.startswith("workspace_")},
    )


def largest_frames(folder: Path, single_precision: bool) -> list[tuple[str, int]]:
    """Functions of the core by the stack that each takes by itself [bytes], the largest first."""
    line = [TOOLS[0], *TARGET, UNITS[single_precision], *CODE, "-fstack-usage", "-c", CORE[0]]
    subprocess.run(line, cwd=folder, check=True)
    rows = re.findall(r":(\w+)(?:\.\w+)*\t(\d+)\t", (folder / "rodmodel_core.su").read_text())
    return sorted(((name, int(size)) for name, size in rows), key=lambda row: -row[1])


def table(footprints: dict[bool, Footprint]) -> str:
    """Markdown: bytes in double and in single precision."""
    double, single = footprints[False], footprints[True]
    rows = [
        ("code of the core", double.code, single.code),
        ("constants of the law", double.law, single.law),
        ("workspace, a solve", double.workspace["solve"], single.workspace["solve"]),
        (
            "workspace, Jacobian or inverse",
            double.workspace["jacobian"],
            single.workspace["jacobian"],
        ),
        ("stack, a solve without loads", double.stack["free"], single.stack["free"]),
        ("stack, a solve with loads", double.stack["loaded"], single.stack["loaded"]),
        ("stack, Jacobian", double.stack["jacobian"], single.stack["jacobian"]),
        ("stack, inverse", double.stack["inverse"], single.stack["inverse"]),
    ]
    lines = ["| bytes | double | single |", "|---|---:|---:|"]
    return "\n".join([*lines, *(f"| {name} | {first:,} | {second:,} |" for name, first, second in rows)])


def main() -> None:
    """Print the table, and the functions with the largest frames."""
    footprints, frames = {}, {}
    with tempfile.TemporaryDirectory() as place:
        for single_precision in (False, True):
            folder = exported(Path(place) / str(single_precision), single_precision=single_precision)
            footprints[single_precision] = footprint(folder, single_precision)
            frames[single_precision] = largest_frames(folder, single_precision)[:5]
    print(table(footprints))
    for single_precision, rows in frames.items():
        print(f"\nLargest frames in {'single' if single_precision else 'double'} precision [bytes]:")
        print("\n".join(f"  {name} {size}" for name, size in rows))


if __name__ == "__main__":
    main()
