"""The reference's page of the design file, from the reader's own table of keys."""

from fem_reference.design.kinds import Flag, Number, Word
from fem_reference.design.tables import TABLES, Key

_HEAD = """\
# The design file

One TOML file says what an actuator is made of: dimensions, material, core, thread, winding, ends, and the
pressures that it is meant for. `designs/paper.toml` is the paper's actuator, `designs/half.toml` the same
at half its size, `designs/ecoflex20.toml` one of 20 mm in Ecoflex 00-30.

    rodmodel-design check designs/ecoflex20.toml
    rodmodel-design show designs/ecoflex20.toml --plot ecoflex20.png
    rodmodel-fem cell --design designs/ecoflex20.toml --pressure-kpa 4 0 0
    rodmodel-fem actuator --design designs/ecoflex20.toml --pressure-kpa 4 0 0
    rodmodel-calibrate run --design designs/ecoflex20.toml --out runs/ecoflex20

`check` ends with status 0, or with 2 and all faults, a line each with file, line and key. `show` prints
what follows from a design, and whether it is similar to the paper's or to that of `--like`: the same but
for the scale of lengths and of moduli.

Single options change the design: `--psi-deg 30` turns its winding, and all else stays. Where a design
names no pressures or no compliance of its ends, `rodmodel-calibrate run` takes the paper's, scaled by
lengths and shear modulus; so it does with moments. A run's directory and dataset hold the design; a
directory of another design is refused.

## Keys

The names hold the units. Numbers may have any digits: they are converted as decimal numbers. Unknown keys
are refused.
"""

_TAIL = """\
## The material

One of three ways:

* `name`, one of the [published silicones](silicones.md).
* `model` with its constants. `ogden` takes `convention`, `shear_moduli_mpa` and `exponents`;
  `neo-hookean` takes one number in `shear_moduli_mpa`; `mooney-rivlin` takes C10 and C01, and `yeoh` one
  to three numbers, in `constants_mpa`.
* `test`, the CSV file of a uniaxial test beside the design, [as testing machines write
  it](../how-to/fit_a_material.md). `rodmodel-calibrate` and `rodmodel-design` fit it each time;
  `rodmodel-fem` does not. Constants that `rodmodel-design fit-material` has printed serve all.

The two conventions of Ogden constants differ by the factor α/2 of each modulus. Look at the energy of
your source: with 2μ/α² it is `abaqus`, with μ/α it is `classic`.

## The thread

By name it has the modulus of its fibre: Kevlar as in Connolly et al. (2015), polyester and nylon 6.6 as
in Morton and Hearle (2008), Table 13.2. A twisted yarn is softer than its fibre, so constants of your own
thread are better. It lies within the outer wall, all of its thickness: the finite elements need silicone
on both sides of it.

## From Python

```python
from fem_reference import Actuator, Design, PeriodCell, design_text, parse_design

# In SI units; the parts are the paper's where none are given.
design = Design(name="mine", end_compliance=0.23e-3)
text = design_text(design)  # the canonical text, for a file and for provenance
assert parse_design(text) == design
cell = PeriodCell.of(design, "coarse")
actuator = Actuator.of(design, "coarse")
```

`read_design` reads a file, `similarity` compares two designs, `design_figure` draws one. `design_schema` is
the file's JSON schema (draft 2020-12), for editors that check TOML; it knows keys, kinds and ranges, and
not whether parts fit each other.
"""


def design_file() -> str:
    """The page."""
    lines = [_HEAD]
    for table in TABLES:
        lines += [f"### {f'[{table.name}]' if table.name else 'Above all tables'}", ""]
        if table.name:
            lines += [table.meaning + (" It may be missing." if table.optional else ""), ""]
        lines += ["| key | value | meaning |", "|---|---|---|", *(_row(key) for key in table.keys), ""]
    return "\n".join([*lines, _TAIL])


def _row(key: Key) -> str:
    told = key.meaning + ("" if not key.optional or "default" in key.meaning else "; optional")
    return f"| `{key.name}` | {_value(key.kind)} | {told} |"


def _value(kind: Number | Word | Flag) -> str:
    if isinstance(kind, Word) and kind.words:
        return ", ".join(f"`{word}`" for word in kind.words)
    return kind.expected
