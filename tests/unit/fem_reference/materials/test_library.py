"""The library of silicones: each has a source, is stable where it was tested, and fits its public test."""

from pathlib import Path

import numpy as np
import pytest

from fem_reference import Ogden
from fem_reference.materials import MODES, SILICONES, first_instability, nominal_stress, published_silicone

ROOT = Path(__file__).parents[4]
# Marechal et al. (2021), Dragon Skin 10 MEDIUM: nominal stress [Pa] of uniaxial tension by stretch.
PUBLIC_STRETCH = np.array([1.1, 1.5, 2.0, 2.5, 3.0])
PUBLIC_STRESS = np.array([11100.0, 53000.0, 113000.0, 190600.0, 272800.0])


@pytest.mark.parametrize("name", SILICONES)
def test_every_silicone_has_a_source_and_is_stable_where_it_was_tested(name):
    silicone = published_silicone(name)
    assert silicone.name == name
    assert "(20" in silicone.source
    if silicone.material.stretch_range is not None:
        for mode in MODES:
            assert first_instability(silicone.material, mode, *silicone.material.stretch_range) is None


def test_the_papers_constants_are_one_entry():
    assert published_silicone("paper").material == Ogden()


def test_dragon_skin_10_follows_its_public_test():
    found = nominal_stress(published_silicone("dragon-skin-10").material, "uniaxial", PUBLIC_STRETCH)
    np.testing.assert_allclose(found, PUBLIC_STRESS, rtol=0.05)


def test_harder_silicones_are_stiffer():
    """In the order of their Shore hardness: 00-10, 00-30, 00-50, 10A, 20A, 30A."""
    names = (
        "ecoflex-00-10",
        "ecoflex-00-30",
        "ecoflex-00-50",
        "dragon-skin-10",
        "dragon-skin-20",
        "dragon-skin-30",
    )
    stress = [float(nominal_stress(published_silicone(name).material, "uniaxial", 2.0)) for name in names]
    assert stress == sorted(stress)


def test_an_unknown_name_is_refused_with_the_nearest():
    with pytest.raises(ValueError, match=r"name: got 'Ecoflex 00-30', expected .*; is it ecoflex-00-30"):
        published_silicone("Ecoflex 00-30")


def test_the_reference_lists_every_silicone():
    text = (ROOT / "docs" / "reference" / "silicones.md").read_text()
    for silicone in SILICONES.values():
        assert f"`{silicone.name}`" in text
