"""Impossible designs are refused before anything is meshed, each fault with file, line and key."""

import re

import pytest

from fem_reference.design import DesignError, parse_design, read_design
from tests.unit.fem_reference.design.schema_file import ROOT

PAPER = (ROOT / "designs" / "paper.toml").read_text()
YEOH = '[material]\nmodel = "yeoh"\nconstants_mpa = [0.11, 0.02]'
MATERIAL = re.search(r"\[material\].*?(?=\[core\])", PAPER, re.DOTALL).group()


def changed(old: str, new: str) -> str:
    assert PAPER.count(old) == 1, old
    return PAPER.replace(old, new)


def line_of(text: str, piece: str) -> int:
    """Line of the last place where a piece stands."""
    return text.count("\n", 0, text.rindex(piece)) + 1


#: What stands in the paper's design, what stands there instead, the key that is told, and what is told of it.
#: The line is the last one with the new text's first line, unless a piece of another line is given.
IMPOSSIBLE = {
    "chambers closed by walls": (
        "outer_wall_mm = 1\ninner_wall_mm = 1.5",
        "outer_wall_mm = 2.5\ninner_wall_mm = 2.6",
        "dimensions.outer_wall_mm and dimensions.inner_wall_mm",
        "which leave no chamber between radius",
    ),
    "chambers closed by partitions": (
        "partition_wall_mm = 1.6",
        "partition_wall_mm = 4.4",
        "dimensions.partition_wall_mm",
        "which closes the chambers; expected less than",
    ),
    "winding outside of the body": (
        "winding_diameter_mm = 11.2",
        "winding_diameter_mm = 12.5",
        "dimensions.winding_diameter_mm",
        "inside the outer wall",
    ),
    "winding in the chambers": (
        "winding_diameter_mm = 11.2",
        "winding_diameter_mm = 9",
        "dimensions.winding_diameter_mm",
        "got 9 mm, expected between 10 and 12 mm",
    ),
    "thread that pokes out of the wall": (
        "winding_diameter_mm = 11.2",
        "winding_diameter_mm = 11.9",
        "dimensions.winding_diameter_mm",
        "got 11.9 mm, expected between 10.178 and 11.822 mm",
    ),
    "negative length": (
        "body_length_mm = 60",
        "body_length_mm = -60",
        "dimensions.body_length_mm",
        "got -60, expected a number from 0.1 to 2000 mm",
    ),
    "length that is no number": (
        "cap_length_mm = 6",
        "cap_length_mm = nan",
        "dimensions.cap_length_mm",
        "got nan",
    ),
    "infinite length": ("cap_length_mm = 6", "cap_length_mm = inf", "dimensions.cap_length_mm", "got inf"),
    "metres for millimetres": (
        "body_diameter_mm = 12",
        "body_diameter_mm = 0.012",
        "dimensions.body_diameter_mm",
        "got 0.012, expected a number from 0.1 to 500 mm; is it in metres?",
    ),
    "a wall in metres": (
        "inner_wall_mm = 1.5",
        "inner_wall_mm = 0.0015",
        "dimensions.inner_wall_mm",
        "expected at least 0.024 mm on a body of 12 mm; is it in another unit?",
    ),
    "micrometres for millimetres": (
        "radius_mm = 0.0889",
        "radius_mm = 88.9",
        "thread.radius_mm",
        "is it in micrometres?",
    ),
    "pascals for megapascals": (
        'name = "kevlar"',
        "young_modulus_mpa = 31067e6",
        "thread.young_modulus_mpa",
        "is it in pascals?",
    ),
    "grams for kilograms": (
        "density_kg_per_m3 = 1070",
        "density_kg_per_m3 = 1.07",
        "material.density_kg_per_m3",
        "is it in g/cm³?",
    ),
    "pascals for kilopascals": (
        "largest_kpa = [60, 60, 60]",
        "largest_kpa = [60e3, 60e3, 60e3]",
        "pressures.largest_kpa",
        "50 shear moduli of the material; is it in another unit?",
    ),
    "radians for degrees": (
        "psi_deg = 0",
        "psi_deg = 1.5708",
        "winding.psi_deg",
        "is it in radians, for 90 deg?",
    ),
    "turns of the thread that overlap": (
        "pitch_mm = 3",
        "pitch_mm = 0.15",
        "winding.pitch_mm",
        "turns of a thread of 0.1778 mm overlap",
    ),
    "a winding longer than the body": (
        "pitch_mm = 3",
        "pitch_mm = 70",
        "winding.pitch_mm",
        "expected at most the body's length of 60 mm",
    ),
    "an unknown layout": (
        'layout = "double-helix"',
        'layout = "double-helis"',
        "winding.layout",
        'got "double-helis", expected one of double-helix, ring, six-helix, none; is it double-helix?',
    ),
    "a spacing for helices": (
        "pitch_mm = 3",
        "pitch_mm = 3\nspacing_mm = 1",
        "winding.spacing_mm",
        "got it for the layout double-helix, expected it without",
        "spacing_mm",
    ),
    "rings without a spacing": (
        'layout = "double-helix"\npsi_deg = 0\npitch_mm = 3',
        'layout = "ring"',
        "winding.spacing_mm",
        "got nothing, expected it for the layout ring",
        "[winding]",
    ),
    "an unknown material": (
        MATERIAL,
        '[material]\nname = "ecoflex-0030"\n\n',
        "material.name",
        "is it ecoflex-00-30?",
        'name = "ecoflex-0030"',
    ),
    "an unknown thread": ('name = "kevlar"', 'name = "kevlr"', "thread.name", "is it kevlar?"),
    "a thread's name and its modulus": (
        'name = "kevlar"',
        'name = "kevlar"\nyoung_modulus_mpa = 5e4',
        "thread.young_modulus_mpa",
        "got it beside name, expected one of the two",
        "young_modulus_mpa = 5e4",
    ),
    "a thread of nothing": (
        'name = "kevlar"\nradius_mm = 0.0889',
        "bends = true",
        "thread.young_modulus_mpa and thread.radius_mm",
        "expected a number, or the name of a thread",
        "[thread]",
    ),
    "exponents without moduli": (
        "shear_moduli_mpa = [0.00681, -0.2881, 0.38165]\n",
        "",
        "material.shear_moduli_mpa",
        "got nothing, expected it for the model ogden",
        "[material]",
    ),
    "no convention": (
        'convention = "abaqus"\n',
        "",
        "material.convention",
        "got nothing, expected it for the model ogden",
        "[material]",
    ),
    "more exponents than moduli": (
        "exponents = [9.33, 3.376, 2.487]",
        "exponents = [9.33, 3.376, 2.487, 1]",
        "material.shear_moduli_mpa and material.exponents",
        "got 4 of them for 3 moduli",
        "shear_moduli_mpa",
    ),
    "moduli of no stiffness": (
        "[0.00681, -0.2881, 0.38165]",
        "[0.00681, -0.2881, 0.1]",
        "material.shear_moduli_mpa",
        "expected it to be positive",
    ),
    "a bulk modulus below the shear modulus": (
        "bulk_modulus_mpa = 100",
        "bulk_modulus_mpa = 0.05",
        "material.bulk_modulus_mpa",
        "got 50000 Pa, expected 200720 to",
    ),
    "constants of another law": (
        MATERIAL,
        f"{YEOH}\nexponents = [2]\n\n",
        "material.exponents",
        "got it for the model yeoh, expected it without",
        "exponents = [2]",
    ),
    "a law that is unstable where it was tested": (
        MATERIAL,
        '[material]\nmodel = "yeoh"\nconstants_mpa = [0.1, -0.05]\nstretch_range = [1, 3]\n\n',
        "material.constants_mpa",
        "unstable by Drucker",
        "constants_mpa",
    ),
    "Mooney–Rivlin of three constants": (
        MATERIAL,
        '[material]\nmodel = "mooney-rivlin"\nconstants_mpa = [0.1, 0.02, 0.01]\n\n',
        "material.constants_mpa",
        "got 3 numbers, expected 2 for mooney-rivlin",
        "constants_mpa",
    ),
    "a name and a model": (
        'model = "ogden"',
        'name = "ecoflex-00-30"\nmodel = "ogden"',
        "material.name and material.model",
        "got name and model, expected one of name, model, test",
        'name = "ecoflex-00-30"',
    ),
    "a test that nobody fits": (
        MATERIAL,
        '[material]\ntest = "pull.csv"\n\n',
        "material.test",
        "`rodmodel-design fit-material pull.csv` prints them",
        "test = ",
    ),
    "a missing table": (
        "[core]\nyoung_modulus_mpa = 5 # the paper's beam fixes the length alone\n",
        "",
        "core",
        "got no such table, expected [core] with young_modulus_mpa",
        "largest_sum_kpa",
    ),
    "a table that is a number": (
        'name = "paper"',
        'name = "paper"\ncore = 5',
        "core",
        "got it again, expected it once; it stands in line 5 too",
        "[core]",
    ),
    "a missing key": (
        "cap_length_mm = 6\n",
        "",
        "dimensions.cap_length_mm",
        "got nothing, expected a number from 0.1 to 2000 mm",
        "[dimensions]",
    ),
    "a key that stands twice": (
        "outer_wall_mm = 1\n",
        "outer_wall_mm = 1\nouter_wall_mm = 2\n",
        "dimensions.outer_wall_mm",
        "got it again, expected it once; it stands in line 9 too",
        "outer_wall_mm = 2",
    ),
    "a table that stands twice": (
        "[pressures]",
        "[ends]\n[pressures]",
        "ends",
        "got it again, expected it once",
        "[ends]",
    ),
    "no TOML": ("psi_deg = 0", "psi_deg = = 0", "winding.psi_deg", "expected TOML"),
    "a string without an end": (
        'layout = "double-helix"',
        'layout = "double-helix',
        "winding.layout",
        "expected TOML",
    ),
    "an unknown key": (
        "cap_length_mm = 6",
        "cap_lenght_mm = 6",
        "dimensions.cap_lenght_mm",
        "is it cap_length_mm?",
    ),
    "another unit in the key": (
        "cap_length_mm = 6",
        "cap_length_m = 0.006",
        "dimensions.cap_length_m",
        "is it cap_length_mm, in the unit that the key names?",
    ),
    "no unit in the key": (
        "cap_length_mm = 6",
        "cap_length = 6",
        "dimensions.cap_length",
        "is it cap_length_mm?",
    ),
    "an unknown table": ("[pressures]", "[pressure]", "pressure", "is it pressures?"),
    "a text for a number": (
        "pitch_mm = 3",
        'pitch_mm = "3 mm"',
        "winding.pitch_mm",
        'got "3 mm", expected a number from 0.01 to 500 mm',
    ),
    "a number for a list": (
        "largest_kpa = [60, 60, 60]",
        "largest_kpa = 60",
        "pressures.largest_kpa",
        "got 60, expected a list of 3 numbers",
    ),
    "two numbers for three": (
        "largest_kpa = [60, 60, 60]",
        "largest_kpa = [\n  60,\n  60]",
        "pressures.largest_kpa",
        "got [60, 60], expected a list of 3 numbers",
        "largest_kpa = [",
    ),
    "a number for a word": (
        'bonded = "cap"',
        "bonded = 1",
        "ends.bonded",
        "got 1, expected one of cap, tip, all",
    ),
    "an empty name": ('name = "paper"', 'name = " "', "name", "expected one line of text"),
    "a flag for a number": (
        "cavity_diameter_mm = 2",
        "cavity_diameter_mm = true",
        "dimensions.cavity_diameter_mm",
        "got true, expected a number",
    ),
}


@pytest.mark.parametrize("case", IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_an_impossible_design_is_refused_with_its_key_and_line(case):
    old, new, key, told, *piece = case
    text = changed(old, new)
    line = line_of(text, (piece or [new.partition("\n")[0]])[0])
    with pytest.raises(DesignError) as caught:
        parse_design(text, "my.toml")
    faults = [fault for fault in caught.value.faults if fault.key == key]
    assert faults, caught.value.lines
    assert faults[0].line == line
    assert told in faults[0].message
    assert f"my.toml, line {line}: {key}: got " in "\n".join(caught.value.lines)
    assert "\n" not in str(caught.value)


def test_all_faults_are_told_in_the_order_of_the_file():
    text = PAPER
    for old, new in (
        ("body_diameter_mm = 12", "body_diameter_mm = 0.012"),
        ("cap_length_mm = 6", "cap_lenght_mm = 6"),
        ("exponents = [9.33, 3.376, 2.487]", "exponents = 2"),
        ('layout = "double-helix"', 'layout = "helix"'),
        ("largest_sum_kpa = 110", "largest_sum_kpa = -1"),
    ):
        text = text.replace(old, new)
    with pytest.raises(DesignError) as caught:
        parse_design(text)
    assert [fault.key for fault in caught.value.faults] == [
        "dimensions.cap_length_mm",
        "dimensions.body_diameter_mm",
        "dimensions.cap_lenght_mm",
        "material.exponents",
        "winding.layout",
        "pressures.largest_sum_kpa",
    ]
    assert str(caught.value).endswith("and 5 more, see `rodmodel-design check`")


def test_a_file_that_is_not_there_or_no_text_is_refused(tmp_path):
    with pytest.raises(DesignError, match=r"absent\.toml, line 1: file: got No such file"):
        read_design(tmp_path / "absent.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b'name = "x"\n\xff\xfe')
    with pytest.raises(DesignError, match=r"binary\.toml, line 2: file: got .*, expected text in UTF-8"):
        read_design(binary)


def test_the_papers_design_itself_is_taken():
    """Or all of the above would be refused for another reason."""
    assert parse_design(PAPER).name == "paper"
