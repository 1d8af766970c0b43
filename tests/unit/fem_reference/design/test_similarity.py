"""Similar designs are found with their factors, and what makes others differ is named."""

from dataclasses import replace

import pytest

from fem_reference.design import Design, read_design, similarity
from fem_reference.geometry import ActuatorGeometry, Core, DoubleHelix, Ring, Thread
from fem_reference.materials import Ogden, neo_hookean
from tests.similar_designs import scaled
from tests.unit.fem_reference.design.schema_file import ROOT


@pytest.mark.parametrize(("length", "modulus"), [(3.0, 0.25), (0.1, 7.0), (1.0, 1.0)])
def test_a_scaled_design_is_similar(length, modulus):
    found = similarity(scaled(Design(), length, modulus), Design())
    assert found.within(1e-12)
    assert found.length == pytest.approx(length, rel=1e-14)
    assert found.modulus == found.pressure == pytest.approx(modulus, rel=1e-14)
    assert found.moment == pytest.approx(modulus * length**3, rel=1e-14)
    assert found.force == pytest.approx(modulus * length**2, rel=1e-14)


def test_the_density_is_no_deviation_and_part_of_the_scale():
    found = similarity(replace(scaled(Design(), 3.0, 0.25), density=2140.0), Design())
    assert found.within(1e-12)
    assert found.scale.density == 2.0
    # A weight is a density times a volume.
    assert found.scale.factor((3, 0, 1)) == pytest.approx(54.0)


def test_half_is_the_papers_at_half_its_size():
    paper, half = (read_design(ROOT / "designs" / f"{name}.toml") for name in ("paper", "half"))
    found = similarity(half, paper)
    assert (found.length, found.modulus) == (0.5, 1.0)
    assert found.within(1e-12)
    # Compliance of the ends goes as one over modulus and length.
    assert half.end_compliance == pytest.approx(paper.end_compliance / (found.modulus * found.length))


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"geometry": ActuatorGeometry(outer_wall=1.1e-3)}, {"outer_wall"}),
        ({"geometry": ActuatorGeometry(outer_wall_variation=(0.0, 0.1, 0.0))}, {"outer_wall_variation 2"}),
        ({"geometry": ActuatorGeometry(body_length=61e-3)}, {"body_length"}),
        ({"core": Core(6e6)}, {"core"}),
        ({"thread": Thread(radius=0.09e-3)}, {"thread radius"}),
        ({"thread": Thread(bends=True)}, {"bends"}),
        ({"winding": DoubleHelix(0.1)}, {"psi"}),
        ({"winding": DoubleHelix(0.0, 3.1e-3)}, {"pitch"}),
        ({"winding": Ring()}, {"layout", "spacing", "psi", "pitch"}),
        ({"material": neo_hookean(Ogden().shear_modulus)}, {"material"}),
    ],
)
def test_what_differs_is_named(change, named):
    found = similarity(replace(Design(), **change), Design())
    assert set(found.deviations) == named
    assert not found.within(1e-6)


def test_a_deviation_is_relative_and_has_its_sign():
    found = similarity(Design(geometry=ActuatorGeometry(outer_wall=1.1e-3)), Design())
    assert found.deviations["outer_wall"] == pytest.approx(0.1 / 1.1)
    stiffens = similarity(Design(material=Ogden((1e5,), (4.0,))), Design(material=neo_hookean(2e5)))
    # In uniaxial tension, 2 μ/α (λ^α − λ^(−α/2)) over μ (λ² − 1/λ).
    expected = 0.5 * (1.6**4 - 1.6**-2) / (1.6**2 - 1.0 / 1.6) - 1.0
    assert stiffens.deviations["material"] == pytest.approx(expected)
