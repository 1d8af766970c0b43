"""A design file stands for the parts that it names."""

import re
from dataclasses import replace

import pytest

from fem_reference.design import Silicone, parse_design
from fem_reference.geometry import THREADS, NoWinding, Ring, SixHelix, Thread
from fem_reference.materials import SILICONES, Ogden, Yeoh, mooney_rivlin, neo_hookean
from tests.unit.fem_reference.design.schema_file import ROOT

PAPER = (ROOT / "designs" / "paper.toml").read_text()
MATERIAL = re.search(r"\[material\]\n(.*?)(?=\[core\])", PAPER, re.DOTALL).group(1)


def with_material(lines: str, **more):
    return parse_design(PAPER.replace(MATERIAL, lines + "\n"), **more)


@pytest.mark.parametrize(
    ("lines", "law"),
    [
        ('model = "neo-hookean"\nshear_moduli_mpa = [0.1]', neo_hookean(0.1e6)),
        ('model = "mooney-rivlin"\nconstants_mpa = [0.1, 0.02]', mooney_rivlin(0.1e6, 0.02e6)),
        ('model = "yeoh"\nconstants_mpa = [0.11, 0.02]', Yeoh((0.11e6, 0.02e6))),
        (
            'model = "ogden"\nconvention = "abaqus"\nshear_moduli_mpa = [0.04]\nexponents = [3]\n'
            "bulk_modulus_mpa = 20\nstretch_range = [1, 3]",
            Ogden((0.04e6,), (3.0,), 20e6, (1.0, 3.0)),
        ),
        (
            'model = "ogden"\nconvention = "classic"\nshear_moduli_mpa = [0.04, -0.01]\nexponents = [3, -2]',
            Ogden((0.06e6, 0.01e6), (3.0, -2.0)),
        ),
    ],
)
def test_constants_make_their_law(lines, law):
    assert with_material(lines).material == law


@pytest.mark.parametrize("name", SILICONES)
def test_a_silicone_is_known_by_its_name(name):
    design = with_material(f'name = "{name}"')
    assert design.material == SILICONES[name].material
    assert design.material_source == SILICONES[name].source


def test_a_test_is_fitted_by_whoever_can(tmp_path):
    file = tmp_path / "pull.csv"
    file.write_text("stretch, stress\n")
    asked = []

    def fit(path):
        asked.append(path)
        return Silicone(neo_hookean(5e4), "pull.csv")

    design = with_material('test = "pull.csv"', folder=tmp_path, fit=fit)
    assert asked == [file]
    assert (design.material, design.material_source) == (neo_hookean(5e4), "pull.csv")


def test_a_source_of_ones_own_stands_before_that_of_the_library():
    assert (
        with_material('name = "ecoflex-00-30"\nsource = "as we cast it"').material_source == "as we cast it"
    )


@pytest.mark.parametrize("name", THREADS)
def test_a_thread_is_known_by_its_name_and_has_its_own_radius(name):
    text = PAPER.replace(
        'name = "kevlar"\nradius_mm = 0.0889', f'name = "{name}"\nradius_mm = 0.1\nbends = true'
    )
    assert parse_design(text).thread == replace(THREADS[name], radius=1e-4, bends=True)


@pytest.mark.parametrize(
    ("lines", "winding"),
    [
        ('layout = "ring"\nspacing_mm = 1.5', Ring(1.5e-3)),
        ('layout = "six-helix"\npitch_mm = 4', SixHelix(0.0, 4e-3)),
        ('layout = "none"', NoWinding()),
    ],
)
def test_layouts(lines, winding):
    text = PAPER.replace('layout = "double-helix"\npsi_deg = 0\npitch_mm = 3', lines)
    assert parse_design(text).winding == winding


def test_a_bare_body_needs_no_thread():
    text = PAPER.replace('[thread]\nname = "kevlar"\nradius_mm = 0.0889\n', "").replace(
        'layout = "double-helix"\npsi_deg = 0\npitch_mm = 3', 'layout = "none"'
    )
    assert parse_design(text).thread == Thread()


def test_what_may_be_left_out_has_the_defaults_of_the_reference():
    text = PAPER[: PAPER.index("[ends]")].replace("density_kg_per_m3 = 1070\n", "")
    design = parse_design(text)
    assert design.density == 1070.0
    assert (design.bonded, design.cap_wound, design.end_compliance) == ("cap", False, None)
    assert (design.pressure_max, design.pressure_sum_max) == (None, None)


def test_the_sum_of_pressures_is_by_default_that_of_the_three():
    design = parse_design(PAPER.replace("largest_sum_kpa = 110\n", ""))
    assert design.pressure_sum_max == 180e3
