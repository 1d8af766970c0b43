"""Sections of all orientations in one law: images, slopes in ψ, files, and the rods made of it."""

import math
from dataclasses import replace
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

import rodmodel
from rodmodel import MirroredLaw, OrientedNetwork, TurnedLaw
from tests.unit.rodmodel import synthetic

PSI = 0.3  # no plane of symmetry
PRESSURE = jnp.array([31e3, 12e3, 22e3])


@pytest.fixture(scope="module")
def law() -> OrientedNetwork:
    network = synthetic.ridge_law(symmetry="full")
    weights = 0.4 * np.random.default_rng(4).standard_normal((len(network.feature_biases), 2))
    return OrientedNetwork(network, jnp.asarray(weights))


@pytest.fixture
def file(law: OrientedNetwork, tmp_path: Path) -> Path:
    calibration = rodmodel.Calibration(
        layout=rodmodel.Layout("double-helix", None, 3e-3),
        actuator=synthetic.ACTUATOR,
        section_law=law,
        domain=rodmodel.Domain((60e3, 60e3, 60e3), 150e3, 8e-3),
        error={"free_bending_angle_rad": {"median": 0.004, "p95": 0.016, "worst": 0.05}},
        provenance={},
    )
    path = tmp_path / "oriented.json"
    rodmodel.save_calibration(calibration, path)
    return path


def states(count: int = 4) -> list[tuple[Array, Array]]:
    rng = np.random.default_rng(7)
    return [(jnp.array(rng.uniform(-50, 50, 3)), jnp.array(rng.uniform(0, 60e3, 3))) for _ in range(count)]


# Images are the same sums in another order: rounding, of sums of terms a hundred times the moment.
@pytest.mark.parametrize("turns", [1, 2])
def test_a_turn_by_120_degrees_renumbers_the_chambers(law: OrientedNetwork, turns: int) -> None:
    there, turned = law.at_psi(PSI + turns * 2.0 * math.pi / 3.0), TurnedLaw(law.at_psi(PSI), turns)
    for u, p in states():
        np.testing.assert_allclose(there.potential(u, p), turned.potential(u, p), rtol=1e-11)
        moment = turned.moment(u, p)
        np.testing.assert_allclose(there.moment(u, p), moment, atol=1e-11 * np.abs(moment).max())


def test_minus_psi_is_the_mirror_image_and_half_a_turn_the_same(law: OrientedNetwork) -> None:
    here, mirrored = law.at_psi(PSI), MirroredLaw(law.at_psi(-PSI))
    for u, p in states():
        moment = here.moment(u, p)
        for other in (mirrored, law.at_psi(PSI + math.pi)):
            np.testing.assert_allclose(other.moment(u, p), moment, atol=1e-11 * np.abs(moment).max())


def test_psi_matters(law: OrientedNetwork) -> None:
    u, p = states(1)[0]
    one, other = law.at_psi(0.0).moment(u, p), law.at_psi(PSI).moment(u, p)
    assert np.abs(one - other).max() > 1e-2 * np.abs(one).max()


@pytest.mark.parametrize("psi", [0.0, PSI, 2.0])
def test_potential_and_moment_vanish_at_rest(law: OrientedNetwork, psi: float) -> None:
    section, zero = law.at_psi(psi), jnp.zeros(3)
    network = law.network
    assert abs(section.potential(zero, zero)) < 1e-14 * network.energy_scale
    unit = network.energy_scale / network.curvature_scale
    np.testing.assert_allclose(section.moment(zero, zero), 0.0, atol=1e-13 * unit)


@pytest.mark.slow
def test_what_a_rod_predicts_has_its_slope_in_psi(file: Path) -> None:
    """Central differences of fourth order with steps of 1e-3 rad: 1e-12 for the step, 1e-11 for rounding of
    what Newton leaves, 1e-12 of the angle over the step."""
    rods = rodmodel.load_oriented("double-helix", path=file)

    def tip(psi: Array) -> Array:
        return rods.at_psi(psi).solve(PRESSURE, tip_force=jnp.array([0.0, 0.02, 0.0])).tip_position

    slope = jax.jacfwd(tip)(jnp.asarray(PSI))
    step = 1e-3
    differences = (
        8.0 * (tip(jnp.asarray(PSI + step)) - tip(jnp.asarray(PSI - step)))
        - (tip(jnp.asarray(PSI + 2 * step)) - tip(jnp.asarray(PSI - 2 * step)))
    ) / (12.0 * step)
    np.testing.assert_allclose(slope, differences, atol=1e-6 * np.abs(differences).max())
    angle = jax.grad(lambda psi: rods.at_psi(psi).solve(PRESSURE).bending_angle)(jnp.asarray(PSI))
    assert np.isfinite(angle)
    assert angle != 0.0


def test_orientations_are_mapped_over(file: Path) -> None:
    rods = rodmodel.load_oriented("double-helix", path=file)
    psi = jnp.linspace(0.0, 1.0, 3)
    together = eqx.filter_vmap(lambda angle: rods.at_psi(angle).solve(PRESSURE).tip_position)(psi)
    for angle, row in zip(psi, together, strict=True):
        np.testing.assert_allclose(row, rods.at_psi(angle).solve(PRESSURE).tip_position, atol=1e-12)


def test_load_takes_any_orientation_from_such_a_file(law: OrientedNetwork, file: Path) -> None:
    rod = rodmodel.load("double-helix", psi=PSI, path=file)
    u, p = states(1)[0]
    expected = law.at_psi(PSI).moment(u, p)
    np.testing.assert_allclose(rod.section.moment(u, p), expected, atol=1e-12 * np.abs(expected).max())
    read = rodmodel.read_calibration(file).section_law
    for one, other in zip(jax.tree.leaves(read), jax.tree.leaves(law), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_file_of_one_orientation_has_no_others(tmp_path: Path) -> None:
    path = tmp_path / "one.json"
    rodmodel.save_calibration(synthetic.calibration(), path)
    with pytest.raises(ValueError, match=r"layout: got 'double-helix' at any psi, expected double-helix, "):
        rodmodel.load_oriented("double-helix", path=path)


def test_parts_that_do_not_fit_are_refused(law: OrientedNetwork) -> None:
    with pytest.raises(ValueError, match="full symmetry"):
        OrientedNetwork(synthetic.ridge_law(symmetry="mirror"), law.orientation_weights)
    with pytest.raises(ValueError, match="orientation_weights: got shape"):
        OrientedNetwork(law.network, law.orientation_weights[1:])
    with pytest.raises(ValueError, match="feature_biases: got 2 rows, expected one, or 6"):
        replace(law.network, feature_biases=jnp.zeros((2, len(law.network.feature_biases))))


def test_two_nested_maps_are_one_after_the_other() -> None:
    """Over orientations and pressures, as a study of windings does; of the law that ships."""
    law = rodmodel.load_oriented("double-helix").section
    psi = jnp.linspace(0.0, 1.0, 400)
    pressures = 30e3 * jnp.eye(3)
    both = jax.jit(jax.vmap(lambda a: jax.vmap(law.at_psi(a).free_curvature)(pressures)))(psi)
    for k in (0, 399):
        for row, pressure in zip(both[k], pressures, strict=True):
            np.testing.assert_allclose(row, law.at_psi(psi[k]).free_curvature(pressure), atol=1e-10)
