"""The fit to measurements: known parameters come back, intervals cover, and what is not known is said."""

import csv
import json
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rodmodel
from calibration.cli import main
from calibration.measured import (
    ANGLE,
    NAMES,
    PLANE,
    POSITIONS,
    PRESSURES,
    AdjustedLaw,
    Measured,
    Noise,
    adjusted_rod,
    fit_measured,
)
from calibration.measured.adjusted_law import adjustment_of, default_parameters
from calibration.measured.held_out import angle_errors
from calibration.measured.identifiability import identify
from calibration.measured.profile_intervals import LowerMinimumError, profile_intervals
from calibration.provenance import sha256
from fem_reference import ActuatorGeometry, Ogden
from rodmodel import CoreRod, LinearLaw, RidgeNetwork
from rodmodel.cli import main as of_rod
from rodmodel.io import OuterWall, adjusted, find, find_among, save_calibration

OUTPUTS = (ANGLE, PLANE, *POSITIONS)
TRUTH = np.array([1.0, 1.05, 0.93, 0.97, 600.0, -400.0, 300.0, 0.15, 0.0, -0.1])
NOISE = Noise()


@pytest.fixture(scope="module")
def rod():
    return rodmodel.load("double-helix")


def pressures(chambers, up_to=40.0):
    """24 rows: some pressures of each set of chambers."""
    each = 24 // len(chambers)
    levels = np.linspace(8.0, up_to, each)
    return 1e3 * np.concatenate([np.outer(levels, chamber) for chamber in chambers])


ALL = pressures([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.6, 0), (0, 0.6, 0.6), (0.6, 0, 0.6)])


@eqx.filter_jit
def solve_each(rod, pressure):
    return jax.vmap(lambda p: rod.solve(p, throw=False))(pressure)


def true_values(rod, parameters, pressure):
    """Angle, plane and tip of the adjusted rod, by its own reference solver."""
    solved = solve_each(adjusted_rod(rod, parameters), pressure)
    assert np.all(solved.converged)
    bend = np.stack([solved.bending_angle, solved.bending_plane], axis=1)
    return np.concatenate([bend, solved.tip_position], axis=1)


def noisy(values, rng):
    noise = rng.normal(size=values.shape)
    sine = np.sin(values[:, 0])
    scales = [np.full_like(sine, NOISE.angle), NOISE.angle / sine, *[np.full_like(sine, NOISE.position)] * 3]
    return values + np.stack(scales, axis=1) * noise


def rows(pressure, values):
    return Measured(pressure, OUTPUTS, values, None, None, tuple(range(2, 2 + len(pressure))))


@pytest.fixture(scope="module")
def exact(rod):
    return true_values(rod, TRUTH, ALL)


@pytest.fixture(scope="module")
def of_exact(rod, exact):
    """Fit to data without noise."""
    return fit_measured(rod, rows(ALL, exact), NOISE)


@pytest.fixture(scope="module")
def noisy_values(exact):
    return noisy(exact, np.random.default_rng(2))


@pytest.fixture(scope="module")
def of_noisy(rod, noisy_values):
    """Fit to data with noise."""
    return fit_measured(rod, rows(ALL, noisy_values), NOISE)


def test_known_parameters_come_back_from_data_without_noise(of_exact):
    fit = of_exact
    # Without loads the scale of the moment law does not show, to any precision.
    assert [held.name for held in fit.held] == ["stiffness_scale"]
    assert fit.held[0].uncertainty == np.inf
    # Data and fit solve the same equations to 1e-9; weighted, that is below 1e-5 of a standard error.
    free = np.isfinite(fit.standard_error)
    assert np.all(np.abs(fit.parameters - TRUTH)[free] < 1e-5 * fit.standard_error[free])
    assert fit.parameters[0] == 1.0
    assert fit.chi_square[0] > 3.0
    assert fit.chi_square[1] < 1e-10


@pytest.mark.slow
def test_the_intervals_of_a_hundred_noise_draws_contain_the_truth(rod, exact):
    rng = np.random.default_rng(0)
    covered, distances, shares, squares = [], [], [], []
    half_width = 1.96  # of a 95 % interval, in standard deviations
    for _ in range(100):
        fit = fit_measured(rod, rows(ALL, noisy(exact, rng)), NOISE)
        assert [held.name for held in fit.held] == ["stiffness_scale"]
        low, high = fit.interval[1:].T
        covered.append((low <= TRUTH[1:]) & (TRUTH[1:] <= high))
        away = (fit.parameters - TRUTH)[1:]
        distances.append(away / fit.standard_error[1:])
        # The interval is not symmetric: it is the half towards the truth that has to reach it.
        towards = np.where(away > 0.0, fit.parameters[1:] - low, high - fit.parameters[1:])
        shares.append(half_width * away / towards)
        squares.append(fit.chi_square[1])
    # A hundred draws of a 95 % interval: standard error 2.2 % for one parameter, less for the mean of nine.
    assert np.mean(covered) >= 0.92
    assert np.all(np.mean(covered, axis=0) >= 0.87)
    # Intervals too wide would cover as well: their width is near the scatter's, which 100 draws tell to
    # ±7 %. It is up to 1.25 standard errors, as these are of the linearised model; the intervals know better.
    scatter = np.std(distances, axis=0)
    assert np.all((scatter > 0.8) & (scatter < 1.4))
    scatter = np.std(shares, axis=0)
    assert np.all((scatter > 0.8) & (scatter < 1.25))
    # χ² of 111 degrees of freedom over them has a standard deviation of 0.13, and the mean of 100 of 0.013.
    assert abs(np.mean(squares) - 1.0) < 0.05


def test_noise_of_another_size_is_estimated_from_the_residuals(rod, noisy_values, of_noisy):
    third = Noise(NOISE.angle / 3.0, NOISE.position / 3.0, estimate=True)
    given, estimated = of_noisy, fit_measured(rod, rows(ALL, noisy_values), third)
    # The same weights up to a factor: the same minimum, to the tolerance of least squares.
    np.testing.assert_allclose(estimated.parameters, given.parameters, rtol=1e-5, atol=0.1)
    assert estimated.noise_scale == pytest.approx(3.0, rel=0.25)  # 111 degrees of freedom: 7 % standard error
    ratio = estimated.standard_error[1:] / given.standard_error[1:]
    np.testing.assert_allclose(ratio, estimated.noise_scale / 3.0, rtol=1e-4)


def test_a_lower_minimum_on_a_profile_starts_the_fit_again_there(rod, exact, monkeypatch):
    # It may lie beyond the bounds of the parameters that the profile leaves free.
    elsewhere, found = np.full(9, 0.3), []
    elsewhere[0] = -20.0

    def once(residuals, here, *rest):
        found.append(here)
        if len(found) == 1:
            raise LowerMinimumError(elsewhere)
        return profile_intervals(residuals, here, *rest)

    monkeypatch.setattr("calibration.measured.fit.profile_intervals", once)
    fit = fit_measured(rod, rows(ALL, exact), NOISE)
    assert len(found) == 2
    # From another start to the same minimum; near it, by the test without noise above.
    np.testing.assert_allclose(found[1], found[0], atol=1e-5)
    assert np.all(np.isfinite(fit.interval[1:]))


def test_data_without_noise_have_finite_intervals_where_noise_is_estimated(rod, exact):
    fit = fit_measured(rod, rows(ALL, exact), Noise(estimate=True))
    free = np.isfinite(fit.standard_error)
    half = (fit.interval[:, 1] - fit.interval[:, 0])[free] / 2.0
    # So near the law is linear: those of Student's t with 111 degrees of freedom, found to a fiftieth.
    np.testing.assert_allclose(half, 1.98 * fit.standard_error[free], rtol=0.03)


def test_chamber_1_alone_says_nothing_of_the_others_and_mixes_its_own(rod):
    pressure = pressures([(1, 0, 0)])
    data = rows(pressure, true_values(rod, default_parameters(), pressure))
    fit = fit_measured(rod, data, NOISE)
    held = {h.name: h for h in fit.held}
    for name in ("stiffness_scale", "pressure_gain_2", "pressure_gain_3"):
        assert held[name].combination == {name: 1.0}
        assert held[name].uncertainty == np.inf
    # Its walls it feels only together: one thicker is the two others thinner.
    assert len(held["wall_variation_1"].combination) > 1
    assert "pressure_gain_1" not in held
    np.testing.assert_allclose(fit.parameters, default_parameters(), atol=1e-4)


def test_a_combination_that_no_row_sees_is_named_and_one_of_it_held():
    # Residuals depend on a + b and on c; d enters nothing.
    jacobian = np.array([[50.0, 50.0, 0.0, 0.0], [30.0, 30.0, 20.0, 0.0], [0.0, 0.0, 40.0, 0.0]])
    free, held = identify(jacobian, ("a", "b", "c", "d"), np.ones(4), (0, 1, 2, 3))
    assert free == [0, 2]
    assert [h.name for h in held] == ["d", "b"]
    assert held[0].combination == {"d": 1.0}
    assert held[1].combination["a"] == pytest.approx(-held[1].combination["b"], rel=1e-12)
    assert set(held[1].combination) == {"a", "b"}


@pytest.mark.slow
def test_a_tip_load_shows_the_stiffness_scale():
    stiffness = jnp.diag(jnp.array([2.4e-4, 2.4e-4, 2.2e-4]))
    per_pressure = 4e-4 * jnp.array([[0.0, 0.866, -0.866], [-1.0, 0.5, 0.5], [0.0, 0.0, 0.0]])
    actuator = rodmodel.Actuator(0.06, 0.006, 0.012, 0.068, 0.73e-3)
    domain = rodmodel.Domain((60e3, 60e3, 60e3), 100e3, 1.5e-3)
    rod = rodmodel.Rod(LinearLaw(stiffness, per_pressure), actuator, domain, 0.01)
    truth = default_parameters()
    truth[:4] = 1.2, 1.0, 1.1, 0.9
    adjusted = adjusted_rod(rod, truth)
    force = np.tile([[0.012, 0.0, 0.0], [0.0, 0.012, 0.0]], (12, 1))
    solved = eqx.filter_jit(jax.vmap(lambda p, f: adjusted.solve(p, tip_force=f, throw=False)))(ALL, force)
    assert np.all(solved.converged)
    data = Measured(ALL, POSITIONS, np.asarray(solved.tip_position), force, None, tuple(range(2, 26)))
    fit = fit_measured(rod, data, Noise(position=0.2e-3))
    assert np.isfinite(fit.standard_error[0])
    # Fixed steps against the adaptive reference: within 1 µm here, a two-hundredth of the noise.
    free = np.isfinite(fit.standard_error)
    assert np.all(np.abs(fit.parameters - truth)[free] < 0.02 * fit.standard_error[free])


@eqx.filter_jit
def section(law, u, p):
    """Moment, stiffness, and both as derivatives of the energy; the moment at the free curvature."""
    at = law.at(p)
    derived = jax.grad(at.energy)(u), jax.hessian(at.energy)(u)
    return (at.moment(u), at.stiffness(u)), derived, at.moment(at.free_curvature)


@pytest.mark.parametrize("pressure", [[0.0, 0.0, 0.0], [30e3, 0.0, 0.0], [5e3, 20e3, 10e3]])
def test_the_adjusted_law_is_a_potential_with_its_moment_and_free_curvature(rod, pressure):
    law = AdjustedLaw(rod.section, jnp.asarray([1.3, *TRUTH[1:]]))
    u, p = jnp.array([3.0, -14.0, 2.0]), jnp.asarray(pressure)
    (moment, stiffness), (slope, curved), left = section(law, u, p)
    np.testing.assert_allclose(moment, slope, rtol=1e-12)
    np.testing.assert_allclose(stiffness, curved, rtol=1e-10, atol=1e-17)
    # Newton's method has come to rounding: of moments, 1e-16 of some 1e-3 N m.
    assert np.max(np.abs(left)) < 1e-16


def test_the_default_parameters_leave_the_law_as_it_is(rod):
    law = AdjustedLaw(rod.section, jnp.asarray(default_parameters()))
    u, p = jnp.array([3.0, -14.0, 2.0]), jnp.array([20e3, 5e3, 0.0])
    assert isinstance(rod.section, RidgeNetwork)
    np.testing.assert_allclose(law.moment(u, p), rod.section.moment(u, p), rtol=1e-14)
    np.testing.assert_allclose(law.volume(u, p), rod.section.volume(u, p), rtol=1e-12)
    np.testing.assert_allclose(law.free_curvature(p), rod.section.free_curvature(p), rtol=1e-12, atol=1e-12)


def test_the_walls_are_those_of_the_actuator_and_close_to_a_ring():
    wall, geometry = OuterWall(), ActuatorGeometry()
    assert wall.thickness == geometry.outer_wall
    assert wall.radius == pytest.approx(geometry.body_diameter / 2 - geometry.outer_wall / 2, rel=1e-15)
    assert wall.shear_modulus == pytest.approx(sum(Ogden().shear_moduli), rel=0.01)
    # Three of them are a thin ring: E π t r³ about either axis, 2 π G t r³ in torsion.
    ring = np.pi * wall.shear_modulus * wall.thickness * wall.radius**3 * np.diag([3.0, 3.0, 2.0])
    np.testing.assert_allclose(wall.stiffness().sum(axis=0), ring, rtol=1e-12, atol=1e-18)
    # Chamber 1 is at +x: its wall is far from the axis about which chamber 1 bends the rod, y.
    first = wall.stiffness()[0]
    assert first[1, 1] > 2 * first[0, 0]


def test_the_domain_is_in_pressures_as_they_are_read(rod):
    parameters = default_parameters()
    parameters[1:7] = 1.2, 1.0, 0.8, 6e3, 0.0, 0.0
    domain = adjusted_rod(rod, parameters).domain
    first, second, third = rod.domain.pressure_max
    assert domain.pressure_max == pytest.approx(((first - 6e3) / 1.2, second, third / 0.8))
    assert domain.pressure_sum_max == pytest.approx((rod.domain.pressure_sum_max - 6e3) / 1.2)


def write(file, pressure, values, separator=","):
    """File of measurements, for people."""
    table = np.concatenate([1e-3 * pressure, values * [57.29577951, 57.29577951, 1e3, 1e3, 1e3]], axis=1)
    with file.open("w", newline="") as stream:
        writer = csv.writer(stream, delimiter=separator)
        writer.writerow([*PRESSURES, *OUTPUTS])
        writer.writerows(table.tolist())


def test_the_command_writes_a_calibration_that_everything_takes_and_draws(rod, exact, tmp_path, capsys):
    file, out, picture = tmp_path / "data.csv", tmp_path / "mine.json", tmp_path / "residuals.png"
    write(file, ALL, noisy(exact, np.random.default_rng(5)))
    arguments = ["fit-measured", str(file), "--out", str(out), "--plot", str(picture)]
    assert main([*arguments, "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["rows"] == record["states"] == 24
    assert record["doubts"] == []
    assert [row["name"].removesuffix("_kpa") for row in record["parameters"]] == list(NAMES)
    assert record["not_identifiable"][0]["held"] == "stiffness_scale"
    before, after = (
        np.array([row[key] for row in record["residuals"]]) for key in ("rms_of_map", "rms_adjusted")
    )
    assert np.all(after < before)
    assert picture.read_bytes()[:4] == b"\x89PNG"

    mine = rodmodel.read_calibration(out)
    note = mine.provenance["adjustment"]
    assert note["command"].startswith("rodmodel-calibrate fit-measured ")
    assert note["base"] == "double-helix_psi0_pitch3.json"
    shipped = Path(rodmodel.__file__).parent / "calibrations" / note["base"]
    assert note["base_sha256"] == sha256(shipped)
    assert note["fit"] == record
    # The rod of the file is that of the parameters that were told, compiled and differentiable.
    told = np.array(
        [(1e3 if "offset" in row["name"] else 1.0) * row["value"] for row in record["parameters"]]
    )
    wanted = adjusted_rod(rod, told).solve(ALL[3])
    compiled = rodmodel.load_core("double-helix", path=out)
    for rod_of_file in (compiled, rodmodel.load("double-helix", path=out)):
        came = rod_of_file.solve(ALL[3])
        np.testing.assert_allclose(came.tip_position, wanted.tip_position, rtol=0, atol=1e-9)
        assert bool(came.in_domain)
    # The parameters' noise is a fraction of that of one measurement, and the bound holds both.
    assert abs(float(wanted.bending_angle) - exact[3, 0]) < NOISE.angle
    measured = mine.error["measured_angle_rad"]["p90"]
    assert 1.2 * NOISE.angle < measured < 4.0 * NOISE.angle
    assert compiled.solve(ALL[3]).error_estimate >= measured
    assert compiled.error_bound.angle[0] == measured
    assert mine.error["measured_angle_rad"]["states"] == 24


@pytest.mark.parametrize(
    "arguments",
    [
        ["predict", "--pressure-kpa", "20", "0", "0"],
        ["inverse", "--bending-angle-deg", "30", "--bending-plane-deg", "180"],
        ["workspace", "--samples", "200"],
    ],
)
def test_the_command_line_takes_the_file(tmp_path, capsys, arguments):
    file = tmp_path / "mine.json"
    save_calibration(adjusted(find("double-helix", 0.0, 3e-3), adjustment_of(TRUTH), {}, {}), file)
    assert of_rod([*arguments, "--calibration", str(file), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["not_converged"] == 0 if "samples" in answer else answer["converged"]


def test_rows_that_are_repeated_tell_no_more_than_one(rod, exact, of_exact):
    once = of_exact
    nine = fit_measured(rod, rows(np.tile(ALL, (9, 1)), np.tile(exact, (9, 1))), NOISE)
    np.testing.assert_allclose(nine.standard_error, once.standard_error, rtol=1e-6)
    np.testing.assert_allclose(nine.interval, once.interval, rtol=1e-6, atol=1e-6)
    assert nine.repeats.rows == 216
    np.testing.assert_allclose(nine.repeats.scatter, 0.0, atol=1e-12)


def test_states_left_out_are_predicted_as_a_fit_without_them_does(rod, noisy_values, of_noisy):
    values, found = noisy_values, of_noisy
    for state in (3, 10, 22):
        others = np.delete(np.arange(len(ALL)), state)
        without = fit_measured(rod, rows(ALL[others], values[others]), NOISE)
        mine = adjusted(find("double-helix", 0.0, 3e-3), adjustment_of(without.parameters), {}, {})
        there = CoreRod.of(find_among([mine], "double-helix", 0.0, 3e-3)).solve(ALL[state], throw=False)
        off = values[state] - [there.bending_angle, there.bending_plane, *there.tip_position]
        off[1] = (off[1] + np.pi) % (2 * np.pi) - np.pi
        # To the law's curvature within the noise: a tenth of a standard deviation of one measurement.
        weighted = (found.held_out[state] - off) * found.weight[state]
        assert np.max(np.abs(weighted)) < 0.35, weighted
        in_fit = (found.adjusted[state] - off) * found.weight[state]
        assert np.linalg.norm(weighted) < 0.5 * np.linalg.norm(in_fit)


def test_the_tip_tells_the_angle_where_that_was_not_measured():
    # An arc of length 60 mm: the tip's way from 1.0 to 1.02 rad, and from 0 to 0.02.
    length, angle = 0.06, np.array([1.0, 0.0])

    def tip(theta):
        theta = np.maximum(theta, 1e-9)
        return np.stack([-length * (1 - np.cos(theta)) / theta, 0 * theta, length * np.sin(theta) / theta], 1)

    off = tip(angle + 0.02) - tip(angle)
    measured = Measured(np.zeros((2, 3)), POSITIONS, off, None, None, (2, 3))
    np.testing.assert_allclose(angle_errors(off, angle + 0.01, measured, length), 0.02, rtol=2e-3)
    only = Measured(np.zeros((2, 3)), (PLANE,), off[:, :1], None, None, (2, 3))
    with pytest.raises(
        ValueError, match="got bending_plane_deg, expected bending_angle_deg, or all of tip_x"
    ):
        angle_errors(off[:, :1], angle, only, length)


def test_the_template_in_the_docs_is_read_and_fitted(rod):
    from calibration.measured import read_measured

    template = Path(__file__).parents[4] / "docs" / "measured_template.csv"
    measured = read_measured(template, rod.domain)
    assert len(measured.lines) == 24
    assert measured.outputs == OUTPUTS
    fit = fit_measured(rod, measured, NOISE)
    assert fit.chi_square[1] < 1.5 < fit.chi_square[0]
