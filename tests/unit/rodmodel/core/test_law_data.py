"""The section law in the core: the formula of its arrays, its derivatives, its images, one ψ of many."""

import dataclasses

import numpy as np
import pytest

import rodmodel
from rodmodel import CoreRod
from rodmodel.core import VARIANTS, Handle, LawData, ffi, law_data
from rodmodel.io import Calibration, RidgeArrays, shipped_calibrations

THIRD = 2.0 * np.pi / 3.0
STATES = 6


@pytest.fixture(scope="module")
def calibrations() -> dict[tuple[str, float | None, float], Calibration]:
    return {(c.layout.name, c.layout.psi, c.layout.pitch): c for c in shipped_calibrations()}


def handle_of(calibration: Calibration, data: LawData, variant: str = VARIANTS[-1]) -> Handle:
    return Handle(data, calibration.actuator, calibration.domain, calibration.error_bound, variant)


def section(handle: Handle, curvature: np.ndarray, pressure: np.ndarray) -> dict[str, np.ndarray | float]:
    found = ffi.new("rm_section *")
    numbers = (ffi.new("rm_real[3]", list(values)) for values in (curvature, pressure))
    assert handle.call.rm_section_at(handle.rod, *numbers, handle.workspace(1), found) == 0
    return {
        "energy": found.energy,
        "moment": np.array(list(found.moment)),
        "stiffness": np.array(list(found.stiffness)).reshape(3, 3),
        "volume": np.array(list(found.volume)),
    }


def states(calibration: Calibration) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(2)
    pressures = random.uniform(size=(STATES, 3)) * 0.6 * np.array(calibration.domain.pressure_max)
    return random.normal(size=(STATES, 3)) * [8.0, 8.0, 2.0], pressures


def turn(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def images(symmetry: str) -> list[tuple[np.ndarray, list[int]]]:
    """U and the order of the pressures, by geometry: seen from chamber k, and in the mirror of that view."""
    turned = [(turn(-k * THIRD), [(c + k) % 3 for c in range(3)]) for k in range(3)]
    mirror = np.diag([-1.0, 1.0, -1.0])
    if symmetry == "none":
        return turned[:1]
    if symmetry == "mirror":
        return [turned[0], (mirror, [0, 2, 1])]
    return turned + [(mirror @ u, [order[0], order[2], order[1]]) for u, order in turned]


def potential(law: RidgeArrays, u: np.ndarray, p: np.ndarray, psi: float | None = None) -> float:
    """Π as the docstring of `rodmodel.RidgeNetwork` has it, in NumPy."""
    lower = np.zeros((3, 3))
    lower[np.tril_indices(3)] = law.factor

    def inner(x: np.ndarray, q: np.ndarray, w: np.ndarray) -> tuple[float, np.ndarray]:
        h = np.concatenate([q, np.tanh(law.feature_weights @ q + w)])
        z = law.directions @ x + law.mixing @ h + law.offsets
        ridges = 0.5 * (z / (1.0 + z**2) + np.arctan(z))
        slope = (law.weights * (1.0 + z**2) ** -2) @ law.directions
        return float(0.5 * np.sum((lower.T @ x) ** 2) + law.weights @ ridges + law.slopes @ h), slope

    total = 0.0
    for number, (axes, order) in enumerate(images(law.symmetry)):
        w = law.feature_biases
        if psi is not None:
            twice = 2.0 * (1.0 if number < 3 else -1.0) * (psi - number % 3 * THIRD)
            w = w + law.orientation_weights @ np.array([np.cos(twice), np.sin(twice)])
        x = axes @ u / law.curvature_scale
        rest, slope = inner(np.zeros(3), np.zeros(3), w)
        total += inner(x, p[order] / law.pressure_scale, w)[0] - rest - slope @ x
    return -law.rest_volume * p.sum() + law.energy_scale * total / len(images(law.symmetry))


@pytest.mark.parametrize("name", [("double-helix", 0.0, 3e-3), ("ring", 0.0, 3e-3)])
def test_the_potential_is_that_of_the_formula(calibrations: dict, name: tuple) -> None:
    calibration = calibrations[name]
    handle = handle_of(calibration, law_data(calibration.law))
    for u, p in zip(*states(calibration), strict=True):
        assert section(handle, u, p)["energy"] == pytest.approx(potential(calibration.law, u, p), rel=1e-11)


def test_one_orientation_of_all_is_that_of_the_formula(calibrations: dict) -> None:
    calibration = calibrations["double-helix", None, 3e-3]
    for psi in (0.0, 0.4):
        handle = handle_of(calibration, law_data(calibration.law, psi=psi))
        for u, p in zip(*states(calibration), strict=True):
            expected = potential(calibration.law, u, p, psi)
            assert section(handle, u, p)["energy"] == pytest.approx(expected, rel=1e-11)


def test_moment_stiffness_and_volume_are_its_derivatives(calibrations: dict) -> None:
    """Differences of order 4: what they leave out is below 1e-8 of the largest entry, rounding about that."""
    calibration = calibrations["six-helix", 0.0, 3e-3]
    handle = handle_of(calibration, law_data(calibration.law))

    def slope(of: str, u: np.ndarray, p: np.ndarray, du: np.ndarray, dp: np.ndarray) -> np.ndarray | float:
        weights = ((1.0, -2.0), (-8.0, -1.0), (8.0, 1.0), (-1.0, 2.0))
        return sum(w * section(handle, u + n * du, p + n * dp)[of] for w, n in weights) / 12.0

    none = np.zeros(3)
    for u, p in zip(*states(calibration), strict=True):
        found = section(handle, u, p)
        for axis, unit in enumerate(np.eye(3)):
            du, dp = 0.02 * unit, 20.0 * unit
            assert slope("energy", u, p, du, none) / 0.02 == pytest.approx(found["moment"][axis], abs=1e-9)
            bent = slope("moment", u, p, du, none) / 0.02
            np.testing.assert_allclose(bent, found["stiffness"][axis], atol=1e-10)
            volume = -slope("energy", u, p + 40.0, none, dp) / 20.0
            assert volume == pytest.approx(section(handle, u, p + 40.0)["volume"][axis], rel=1e-6)
        np.testing.assert_array_equal(found["stiffness"], found["stiffness"].T)


def test_a_turned_or_mirrored_section_renumbers_its_chambers(calibrations: dict) -> None:
    calibration = calibrations["double-helix", np.deg2rad(12.0), 3e-3]
    plain = handle_of(calibration, law_data(calibration.law))
    turned = handle_of(calibration, law_data(calibration.law, turns=1))
    mirrored = handle_of(calibration, law_data(calibration.law, mirrored=True))
    mirror = np.diag([-1.0, 1.0, -1.0])
    for u, p in zip(*states(calibration), strict=True):
        energy = section(plain, u, p)["energy"]
        # The winding one chamber further round: what bent towards chamber 1 bends towards chamber 2.
        assert section(turned, turn(THIRD) @ u, np.roll(p, 1))["energy"] == pytest.approx(energy, rel=1e-12)
        assert section(mirrored, mirror @ u, p[[0, 2, 1]])["energy"] == pytest.approx(energy, rel=1e-12)


def test_psi_is_an_input_of_the_core(calibrations: dict) -> None:
    """`rm_orient` makes the law of an orientation that `law_data` makes."""
    calibration = calibrations["double-helix", None, 3e-3]
    data = law_data(calibration.law)
    handle = handle_of(calibration, data)
    oriented, keep = ffi.new("rm_oriented *"), []
    oriented.law = handle.rod.law
    for name, values in data.orientation.items():
        keep.append(np.ascontiguousarray(values))
        setattr(oriented, name, ffi.from_buffer("rm_real *", keep[-1]))
    memory = np.zeros(handle.call.rm_orient_size(oriented))
    handle.call.rm_orient(oriented, 0.7, ffi.from_buffer("rm_real *", memory), ffi.addressof(handle.rod.law))
    expected = handle_of(calibration, law_data(calibration.law, psi=0.7))
    for u, p in zip(*states(calibration), strict=True):
        for name, value in section(expected, u, p).items():
            np.testing.assert_allclose(section(handle, u, p)[name], value, rtol=1e-11, atol=1e-15)


def test_the_free_curvature_has_no_moment(calibrations: dict) -> None:
    calibration = calibrations["double-helix", 0.0, 3e-3]
    handle = handle_of(calibration, law_data(calibration.law))
    for _, p in zip(*states(calibration), strict=True):
        free = ffi.new("rm_real[3]")
        assert (
            handle.call.rm_free_curvature(
                handle.rod, ffi.new("rm_real[3]", list(p)), handle.workspace(1), free
            )
            == 0
        )
        np.testing.assert_allclose(section(handle, np.array(list(free)), p)["moment"], 0.0, atol=1e-16)


def test_variants_differ_in_rounding_alone(calibrations: dict) -> None:
    calibration = calibrations["double-helix", 0.0, 3e-3]
    data = law_data(calibration.law)
    handles = [handle_of(calibration, data, variant) for variant in VARIANTS]
    for u, p in zip(*states(calibration), strict=True):
        first, *others = (section(handle, u, p) for handle in handles)
        for other in others:
            for name, value in first.items():
                np.testing.assert_allclose(other[name], value, rtol=1e-10, atol=1e-16)


def test_numbers_that_cannot_be_used_are_refused(calibrations: dict) -> None:
    calibration = calibrations["double-helix", 0.0, 3e-3]
    bad = dataclasses.replace(calibration.actuator, stiff_tip=1.0)
    with pytest.raises(ValueError, match="law, actuator, domain: got a length"):
        Handle(law_data(calibration.law), bad, calibration.domain, 0.1)


def test_layouts_that_one_calibration_serves_bend_alike() -> None:
    """A pressure in chamber 2 at ψ = 60° does what it does in another at ψ = 0: the same angle."""
    angles = {
        round(float(rodmodel.load_core("double-helix", psi).solve(p).bending_angle), 12)
        for psi, p in ((0.0, [20e3, 0, 0]), (THIRD, [0, 20e3, 0]), (2.0 * THIRD, [0, 0, 20e3]))
    }
    assert len(angles) == 1
    assert isinstance(rodmodel.load_core("ring"), CoreRod)
