"""Fits recover planted laws from noisy tests, follow a public test, and say when they should not be used."""

import tomllib
import warnings
from decimal import Decimal

import numpy as np
import pytest

from calibration.material import (
    MaterialTest,
    fit_material,
    fit_record,
    fit_table,
    material_lines,
    material_table,
)
from calibration.material.candidates import CANDIDATES
from calibration.material.plot import material_plot, write_material_plot
from calibration.material.points import points_of, stress_at_rest
from fem_reference import Material, Ogden, Yeoh, mooney_rivlin
from fem_reference.materials import MODES, first_instability, nominal_stress

NOISE = 0.02
# Marechal et al. (2021), Dragon Skin 10 MEDIUM, uniaxial.
PUBLIC = MaterialTest(
    "public",
    "uniaxial",
    np.array([1.1, 1.5, 2.0, 2.5, 3.0]),
    np.array([11100.0, 53000.0, 113000.0, 190600.0, 272800.0]),
)


def planted(law: Material, modes: tuple[str, ...] = ("uniaxial",), most: float = 2.5) -> list[MaterialTest]:
    """Tests of a law, each stress with 2 % of noise."""
    random, tests = np.random.default_rng(1), []
    for mode in modes:
        stretch = np.linspace(1.03, most if mode == "uniaxial" else most**0.6, 40)
        noise = 1.0 + NOISE * random.standard_normal(40)
        tests.append(MaterialTest(mode, mode, stretch, nominal_stress(law, mode, stretch) * noise))
    return tests


LAWS = {
    "Ogden 1": Ogden((40e3,), (3.2,)),
    "Ogden 2": Ogden((52e3, 3e3), (1.6, 5.0)),
    "Yeoh 2": Yeoh((25e3, 1.5e3)),
    "Yeoh 3": Yeoh((20e3, 1e3, 0.1e3)),
    "Mooney–Rivlin": mooney_rivlin(40e3, 12e3),
}


@pytest.mark.parametrize("name", LAWS)
def test_a_planted_law_is_recovered_within_the_noise(name):
    law, tests = LAWS[name], planted(LAWS[name], ("uniaxial", "biaxial"), most=3.0)
    fit = fit_material(tests)
    for test in tests:
        truth = nominal_stress(law, test.mode, test.stretch)
        np.testing.assert_allclose(nominal_stress(fit.material, test.mode, test.stretch), truth, rtol=NOISE)
    assert fit.doubts == ()
    low, high = fit.material.stretch_range
    assert all(first_instability(fit.material, mode, low, high) is None for mode in MODES)
    # 80 rows with 2 % of noise: its mean is known to 0.2 %, and the chosen law leaves the noise alone.
    assert fit.chosen.error == pytest.approx(NOISE, rel=0.25)


@pytest.mark.parametrize("name", ["Ogden 1", "Yeoh 2", "Mooney–Rivlin"])
def test_constants_that_the_rows_tell_are_the_planted_ones(name):
    law = LAWS[name]
    candidate = next(candidate for candidate in CANDIDATES if candidate.name == name)
    found = candidate.fit(points_of(planted(law, ("uniaxial", "biaxial"), most=3.0)))
    if isinstance(law, Yeoh):
        np.testing.assert_allclose(found.constants, law.constants, rtol=0.05)
    else:
        np.testing.assert_allclose(found.shear_moduli, law.shear_moduli, rtol=0.05)
        np.testing.assert_allclose(found.exponents, law.exponents, rtol=0.05)


@pytest.fixture(scope="module")
def public():
    return fit_material([PUBLIC])


def test_the_public_test_is_followed_within_five_per_cent(public):
    found = nominal_stress(public.material, "uniaxial", PUBLIC.stretch)
    np.testing.assert_allclose(found, PUBLIC.stress, rtol=0.05)
    assert public.doubts == ()
    assert public.material.stretch_range == (1.0, 3.0)


def test_a_law_with_as_many_constants_as_rows_is_not_fitted(public):
    (most,) = (law for law in public.laws if law.name == "Ogden 3")
    assert (most.material, most.why_not) == (None, "too few rows")


def test_the_lines_for_a_design_hold_the_chosen_law(public):
    table = tomllib.loads(material_lines(public.material, public.source))["material"]
    assert table.pop("source") == "Ogden 1 fitted to public (uniaxial)"
    # With decimal digits, as a design file is read.
    moduli = tuple(float(Decimal(repr(mu)).scaleb(6)) for mu in table["shear_moduli_mpa"])
    rebuilt = Ogden(moduli, tuple(table["exponents"]), stretch_range=tuple(table["stretch_range"]))
    assert (table["model"], table["convention"]) == ("ogden", "abaqus")
    assert rebuilt == public.material


@pytest.mark.parametrize(
    ("law", "table"),
    [
        (Ogden((60e3,), (2.0,)), {"model": "neo-hookean", "shear_moduli_mpa": [0.06]}),
        (mooney_rivlin(40e3, 12e3), {"model": "mooney-rivlin", "constants_mpa": [0.04, 0.012]}),
        (Yeoh((25e3, 1.5e3)), {"model": "yeoh", "constants_mpa": [0.025, 0.0015]}),
    ],
)
def test_each_law_has_the_keys_of_its_model(law, table):
    assert material_table(law) == table


def test_the_table_and_the_record_name_all_laws_and_the_chosen_one(public):
    text, record = fit_table(public), fit_record(public)
    assert [
        line.strip().partition(" ")[2].split("  ")[0].strip() for line in text.splitlines() if line[0] == "*"
    ] == ["Ogden 1"]
    assert [law["name"] for law in record["laws"]] == [candidate.name for candidate in CANDIDATES]
    assert record["chosen"] == "Ogden 1"


def test_two_silicones_in_one_fit_are_in_doubt():
    other = MaterialTest("other", "uniaxial", PUBLIC.stretch, 2.0 * PUBLIC.stress)
    assert any("off by" in doubt for doubt in fit_material([PUBLIC, other]).doubts)


def test_a_stress_at_rest_is_found_and_said():
    (test,) = planted(LAWS["Ogden 1"])
    shifted = MaterialTest("shifted", "uniaxial", test.stretch, test.stress - 3e3)
    rest, error = stress_at_rest(shifted.stretch, shifted.stress)
    assert abs(rest + 3e3) < 4.0 * error
    assert error < 1e3
    assert any("its stress at rest is -" in note for note in fit_material([shifted]).notes)


def test_the_plot_shows_tests_laws_and_errors_with_no_label_on_another(public, tmp_path):
    figure = material_plot(public)
    figure.draw_without_rendering()
    stresses, errors = figure.axes
    labels = [text.get_text() for text in stresses.get_legend().get_texts()]
    assert "Ogden 1, chosen" in labels
    assert "uniaxial test" in labels
    (shown,) = [line for line in errors.lines if len(line.get_xdata()) == len(PUBLIC.stretch)]
    np.testing.assert_allclose(shown.get_ydata(), 100.0 * public.points.error(public.material))
    # The legend covers no row of the test.
    box = stresses.get_legend().get_window_extent()
    places = stresses.transData.transform(np.column_stack([PUBLIC.stretch, PUBLIC.stress / 1e3]))
    assert not any(box.contains(*place) for place in places)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write_material_plot(public, tmp_path / "fit.svg")
    assert (tmp_path / "fit.svg").read_text().startswith("<?xml")
