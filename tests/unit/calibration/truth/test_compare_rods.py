"""Ends from truth, and the rod judged by it: what is put in comes out; what is out of reach is left."""

import json
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr

import rodmodel
from calibration.cli import main
from calibration.ends import fit as ends
from calibration.ends import runs_for
from calibration.ends.runs_for_layout import PAPER
from calibration.fit import on_loading_branch
from calibration.truth import TruthError, compare_with_truth, free_states, judgement, load_limits
from calibration.truth.mesh_torsion import on_mesh
from rodmodel import Actuator, Calibration, Layout
from rodmodel.io import find
from tests.unit.rodmodel import synthetic

BODY, CAP = 60e-3, 6e-3
PLANTED = {
    "base_turn": 1.7e-6,
    "base_lag": 3.1e-3,
    "stiff_tip": 0.8e-3,
    "tip_offset": 2.2e-3,
    "tip_offset_curvature": 9.0,
    "base_growth": 0.4,
}
# What no fit changes.
FIXED = {"tip_draw": 1e-9 * ends.DRAW}
# Of the cell at rest and at the states [N m²].
AT_REST = 2.5e-4
STIFFNESS = AT_REST * np.array(
    [np.eye(3)]
    + [
        np.array([[0.9, 0.05, 0.02], [0.05, 0.8, -0.03], [0.02, -0.03, 0.7]]) - 0.02 * n * np.eye(3)
        for n in range(5)
    ]
)
SOFTNESS = AT_REST * np.linalg.inv(STIFFNESS[1:])
HELD = 4.2e-3
COMPLIANCE = 0.2e-3  # [m/N]
# Of the cell's chambers per length, at rest and at the states [m²].
VOLUME = 1e-6 * np.array(
    [
        [16.0, 16.0, 16.0],
        [22.0, 12.0, 12.0],
        [28.0, 8.0, 9.0],
        [10.0, 21.0, 25.0],
        [15.0, 24.0, 7.0],
        [1.0, 30.0, 29.0],
    ]
)
CURVATURE = np.array(
    [[0.0, -7.0, 0.5], [0.0, -20.0, 0.0], [4.0, 9.0, -1.0], [12.0, 0.0, 2.0], [0.0, 30.0, 0.0]]
)


PRESSURE = 1e3 * np.array(
    [[12.0, 0.0, 0.0], [35.0, 0.0, 0.0], [0.0, 10.0, 20.0], [15.0, 30.0, 0.0], [0.0, 40.0, 40.0]]
)


def truth_of(role="fit", **changed) -> xr.Dataset:
    """Runs of an actuator that is an arc between ends."""
    count = len(CURVATURE)
    rod = np.zeros((count, 3))
    tip, axis = ends.tip_between_ends(1.01 * CURVATURE, PRESSURE, SOFTNESS, BODY, CAP, **PLANTED, **FIXED)
    values = {
        "pressure": (("state", "chamber"), PRESSURE),
        "middle_curvature": (("state", "axis"), (1.0 - 10.0 * COMPLIANCE) * CURVATURE),
        "tip_force": (("state", "axis"), rod),
        "gravity": (("state", "axis"), rod),
        "tip_position": (("state", "axis"), tip),
        # Only the third column counts.
        "tip_rotation": (("state", "row", "column"), np.stack([rod, rod, axis], axis=2)),
        "middle_shear": (("state", "across"), rod[:, :2]),
        "middle_force": (("state", "across"), rod[:, :2]),
        "volume": (("state", "chamber"), BODY * VOLUME[1:] - HELD * (VOLUME[1:] - VOLUME[0])),
        # None of these has a say in the ends.
        **{name: (("state",), np.zeros(count)) for name in ("bending_angle", "bending_plane", "residual")},
        "jumped": (("state",), np.zeros(count)),
        "stable": (("state",), np.ones(count, dtype=int)),
        "case": (("state",), np.array(["chamber1-fit"] * count, dtype=object)),
        "role": (("state",), np.array([role] * count, dtype=object)),
        **changed,
    }
    return xr.Dataset(values, attrs={"mesh": "coarse"})


@pytest.fixture
def known_cell(monkeypatch):
    """The cell bends as the actuator's middle, and by so much less as its ends give."""

    def bending(chosen, compliance):
        curvature = 1.01 * (1.0 - 10.0 * compliance) * CURVATURE
        return ends.Bending(curvature, np.full(len(CURVATURE), 1.01), VOLUME, STIFFNESS)

    monkeypatch.setattr(ends, "cell_bending", bending)


def test_the_arc_between_ends_is_that_of_a_rod():
    """Against the rod's closed form, to rounding."""
    calibration = synthetic.calibration()
    actuator = Actuator(BODY, CAP, 12e-3, 0.1, 1e-3, base_stiffness=AT_REST, **FIXED, **PLANTED)
    rod = rodmodel.Rod(calibration.section_law, actuator, calibration.domain, 0.01)
    pressure = jnp.array([30e3, 12e3, 5e3])
    free = rod.section.free_curvature(pressure)
    softness = AT_REST * np.linalg.inv(rod.section.stiffness(free, pressure))[None]
    curvature = np.asarray(free)[None]
    (tip,), (axis,) = ends.tip_between_ends(
        curvature, np.asarray(pressure)[None], softness, BODY, CAP, **PLANTED, **FIXED
    )
    np.testing.assert_allclose(tip, rod.solve(pressure).tip_position, atol=1e-14)
    np.testing.assert_allclose(axis, rod.solve(pressure).tip_rotation[:, 2], atol=1e-14)


def test_the_compliance_of_the_ends_is_found(known_cell):
    """In a cell that is linear in it, whatever it is tried with; with noise, within three standard errors."""
    for trial in (0.1e-3, 0.4e-3):
        found = ends.fit_compliance(truth_of(), BODY, trial)
        assert found.value == pytest.approx(COMPLIANCE, rel=1e-9)
        assert found.after < 1e-12 < 1e-3 < found.before
    noisy = truth_of()
    noise = np.random.default_rng(2).standard_normal(CURVATURE.shape)
    noisy["middle_curvature"] = noisy["middle_curvature"] + 3e-4 * noise
    found = ends.fit_compliance(noisy, BODY, 0.3e-3)
    assert 0.0 < abs(found.value - COMPLIANCE) < 3.0 * found.standard_error < 0.2 * COMPLIANCE


def test_the_ends_are_found(known_cell):
    """Planted ones, to the tolerance of the least squares; with noise, within three standard errors."""
    found = ends.fit_ends(truth_of(), BODY, CAP, 0.0)
    assert found.values == pytest.approx(
        {**PLANTED, **FIXED, "base_stiffness": AT_REST, "held_length": HELD}, rel=1e-6
    )
    assert found.before > 1e-4 > 1e-9 > found.after
    assert found.volume_before > 1e-8 > 1e-18 > found.volume_after
    noisy = truth_of()
    noisy["tip_position"] = noisy["tip_position"] + 2e-5 * np.random.default_rng(1).standard_normal((5, 3))
    noisy["volume"] = noisy["volume"] + 2e-9 * np.random.default_rng(4).standard_normal((5, 3))
    found = ends.fit_ends(noisy, BODY, CAP, 0.0)
    for name, planted in {**PLANTED, "held_length": HELD}.items():
        assert 0.0 < found.standard_errors[name] < 0.2 * planted
        assert abs(found.values[name] - planted) < 3.0 * found.standard_errors[name]


def leaning_states(role: str = "fit", noise: float = 0.0) -> xr.Dataset:
    """Loaded states whose sections lean by 0.3 rad/N; one does not tell its frames."""
    states = truth_of(role).isel(state=[1, 2, 3])
    force = np.array([[0.03, 0.0], [-0.01, 0.02], [0.0, 0.04]])
    states["tip_force"][:, 0] = 0.03
    states["middle_force"][:] = force
    states["middle_shear"][:] = 0.3 * force + noise * np.random.default_rng(3).standard_normal((3, 2))
    states["middle_shear"][2] = np.nan
    return states


def test_how_sections_lean_under_a_force_is_found():
    value, error = ends.fit_shear(leaning_states())
    assert (value, error) == (pytest.approx(0.3, rel=1e-12), pytest.approx(0.0, abs=1e-12))
    value, error = ends.fit_shear(leaning_states(noise=3e-4))
    assert 0.0 < abs(value - 0.3) < 3.0 * error < 0.1
    assert ends.fit_shear(truth_of()) is None
    assert ends.fit_shear(leaning_states(role="judge")) is None


def test_judges_never_fit(known_cell):
    with pytest.raises(TruthError, match="no unloaded state of a fit run"):
        ends.fit_ends(truth_of(role="judge"), BODY, CAP, 0.0)


def test_loaded_states_and_those_behind_a_jump_are_told_apart():
    force = np.zeros((5, 3))
    force[1, 0] = 0.01
    truth = truth_of(tip_force=(("state", "axis"), force), jumped=(("state",), np.array([0, 0, 0, 1, 0])))
    assert free_states(truth).tolist() == [True, False, True, False, False]
    assert on_loading_branch(truth, truth["case"].values).tolist() == [True, True, True, False, False]


def rod_of_the_runs() -> rodmodel.CoreRod:
    """The shipped rod of ψ = 0, with the torsion that its winding has on the runs' mesh."""
    found = find("double-helix", 0.0, 3e-3)
    return rodmodel.CoreRod.of(
        replace(found, calibration=on_mesh(found.calibration, "coarse", load_limits()))
    )


@pytest.fixture(scope="module")
def exact() -> xr.Dataset:
    """Runs of which the shipped rods' own predictions are the answers, compiled and in many steps."""
    rows = {
        "chamber1": [(10e3, 0.0, 0.0), (30e3, 0.0, 0.0), (75e3, 0.0, 0.0)],
        "force-upright-25": [(25e3, 0.0, 0.0)],
    }
    forces = {"chamber1": np.zeros(3), "force-upright-25": np.array([0.0, 0.03, 0.0])}
    rod = rod_of_the_runs()
    states: dict[str, list] = {name: [] for name in ("case", "pressure", "tip_force", "gravity", "solution")}
    for case, pressures in rows.items():
        for pressure in pressures:
            force = forces[case]
            gravity = np.array([0.0, 0.0, -9.81]) * force.any()
            loads = {"tip_force": force, "gravity": gravity} if force.any() else {}
            solution = rod.solve(pressure, throw=False, steps=128, **loads)
            for name, value in zip(states, (case, pressure, force, gravity, solution), strict=True):
                states[name].append(value)

    def of(name):
        return np.array([np.asarray(getattr(s, name)) for s in states["solution"]])

    count = len(states["case"])
    return xr.Dataset(
        {
            "pressure": (("state", "chamber"), np.array(states["pressure"])),
            "tip_force": (("state", "axis"), np.array(states["tip_force"])),
            "gravity": (("state", "axis"), np.array(states["gravity"])),
            "tip_position": (("state", "axis"), of("tip_position")),
            "tip_rotation": (("state", "row", "column"), of("tip_rotation")),
            "middle_curvature": (("state", "axis"), np.zeros((count, 3))),
            "middle_shear": (("state", "across"), np.zeros((count, 2))),
            "middle_force": (("state", "across"), np.zeros((count, 2))),
            "residual": (("state",), np.zeros(count)),
            "bending_angle": (("state",), of("bending_angle")),
            "bending_plane": (("state",), of("bending_plane")),
            "volume": (("state", "chamber"), of("chamber_volume")),
            "jumped": (("state",), np.zeros(count)),
            "stable": (("state",), np.ones(count, dtype=int)),
            "case": (("state",), np.array(states["case"], dtype=object)),
            "role": (("state",), np.array(["judge"] * count, dtype=object)),
        },
        attrs={"mesh": "coarse"},
    )


def test_a_truth_of_the_rods_own_has_no_error(exact):
    verdict = compare_with_truth(exact)
    # 75 kPa is outside the domain.
    assert verdict.judged.tolist() == [True, True, False, True]
    figures = judgement(verdict, "judge")
    assert (figures["states"], figures["judged"]) == (4, 3)
    # 64 steps beside 128: 1e-5 of the length.
    for name in ("tip_percent", "loaded_tip_percent", "angle_deg", "loaded_angle_deg", "plane_deg"):
        assert figures[name]["worst"] < 1e-2, name


def test_a_rod_is_compared_with_the_torsion_of_a_runs_mesh(exact):
    """That of the limit differs by 0.2 % of the length under a force aside, and by nothing without one."""
    at_limit = rodmodel.load_core("double-helix")
    aside = at_limit.solve((25e3, 0.0, 0.0), (0.0, 0.03, 0.0), gravity=(0.0, 0.0, -9.81))
    apart = np.linalg.norm(aside.tip_position - exact["tip_position"].values[3]) / BODY
    assert 1e-3 < apart < 5e-3
    free = at_limit.solve((30e3, 0.0, 0.0))
    assert np.linalg.norm(free.tip_position - exact["tip_position"].values[1]) / BODY < 1e-5


def test_errors_put_in_are_found_where_they_are(exact):
    off = exact.copy(deep=True)
    off["tip_position"][1, 0] += 0.6e-3
    off["bending_angle"][3] += np.deg2rad(2.0)
    figures = judgement(compare_with_truth(off), "judge")
    assert figures["tip_percent"]["worst"] == pytest.approx(1.0, abs=1e-2)
    assert figures["tip_percent"]["worst_at"] == {"case": "chamber1", "pressure_kpa": [30.0, 0.0, 0.0]}
    assert figures["loaded_angle_deg"]["worst"] == pytest.approx(2.0, abs=1e-2)


def test_the_way_under_a_tip_force_is_judged_by_itself(exact):
    rod = rod_of_the_runs()
    loaded = exact.isel(state=[3])
    without = loaded.copy(deep=True)
    without["tip_force"][:] = 0.0
    (pressure,), (gravity,) = (loaded[name].values for name in ("pressure", "gravity"))
    without["tip_position"][0] = rod.solve(pressure, gravity=gravity, steps=128).tip_position
    way = loaded["tip_position"].values - without["tip_position"].values
    # A tenth farther in truth than by the rod.
    loaded = loaded.assign(tip_position=loaded["tip_position"] + 0.1 * way)
    figures = judgement(compare_with_truth(xr.concat([without, loaded], "state")), "judge")
    assert figures["response_percent"]["worst"] == pytest.approx(100.0 * 0.1 / 1.1, abs=0.01)
    assert "response_percent" not in judgement(compare_with_truth(exact), "judge")


def test_the_command_writes_the_ends_into_files(known_cell, tmp_path, capsys):
    truth, file = tmp_path / "truth.nc", tmp_path / "calibration.json"
    xr.concat([truth_of(), leaning_states()], "state").to_netcdf(truth, engine="h5netcdf")
    made: Calibration = synthetic.calibration()
    rodmodel.save_calibration(made, file)
    assert main(["ends", str(truth), str(file), "--end-compliance-mm-per-n", "0"]) == 0
    told = capsys.readouterr().out
    assert "end compliance 0.200 ± 0.000 mm/N, from 5 states" in told
    assert "base lag                    3.100 ± 0.000 mm" in told
    written = rodmodel.read_calibration(file)
    for name, planted in PLANTED.items():
        assert getattr(written.actuator, name) == pytest.approx(planted, rel=1e-6)
    assert "shear compliance 0.300 ± 0.000 rad/N" in told
    assert written.actuator.shear_compliance == pytest.approx(0.3, rel=1e-12)
    assert written.provenance["ends"]["states"] == 5
    assert written.provenance["ends"]["compliance_m_per_n"] == 0.0
    assert written.layout == Layout("double-helix", 0.0, 3e-3)


def test_a_winding_with_fit_runs_has_ends_of_its_own(known_cell, tmp_path, capsys):
    """Those of its runs, and the other windings those of the paper's: here chambers keep half as much."""
    wide = truth_of(
        volume=(("state", "chamber"), BODY * VOLUME[1:] - 0.5 * HELD * (VOLUME[1:] - VOLUME[0])),
        case=(("state",), np.array(["pitch6-chamber2-fit"] * 5, dtype=object)),
    )
    judge = truth_of(role="judge", case=(("state",), np.array(["pitch4-chamber1"] * 5, dtype=object)))
    truth = xr.concat([truth_of(), wide, judge], "state")
    pitches = {3e-3: HELD, 4e-3: HELD, 6e-3: 0.5 * HELD}
    files = [tmp_path / f"pitch{1e3 * pitch:g}.json" for pitch in pitches]
    truth.to_netcdf(tmp_path / "truth.nc", engine="h5netcdf")
    for pitch, file in zip(pitches, files, strict=True):
        made = replace(synthetic.calibration(), layout=Layout("double-helix", 0.0, pitch))
        rodmodel.save_calibration(made, file)
    assert main(["ends", str(tmp_path / "truth.nc"), *map(str, files), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["ends"]
    assert [note["winding"]["pitch"] for note in told] == [3e-3, 6e-3]
    for held, file in zip(pitches.values(), files, strict=True):
        written = rodmodel.read_calibration(file)
        assert written.actuator.held_length == pytest.approx(held, rel=1e-6)
        assert written.provenance["ends"]["values"]["held_length"] == written.actuator.held_length
    anywhere = Layout("double-helix", None, 6e-3)
    assert runs_for(truth, anywhere)[0] == PAPER == runs_for(truth, Layout("ring", 0.0, 6e-3))[0]


def test_a_truth_that_cannot_be_read_is_told(tmp_path, capsys):
    assert main(["judge", str(tmp_path / "none.nc")]) == 2
    assert "expected a file of `truth --gather`" in capsys.readouterr().err


def test_a_file_of_something_else_is_told(tmp_path, capsys):
    file = tmp_path / "other.nc"
    xr.Dataset({"pressure": (("state", "chamber"), np.zeros((2, 3)))}).to_netcdf(file, engine="h5netcdf")
    for command in ("judge", "ends"):
        assert main([command, str(file)]) == 2
        line = capsys.readouterr().err
        assert "lacks bending_angle, " in line
        assert "expected a file of `truth --gather`" in line


def test_the_command_prints_one_object(exact, tmp_path, capsys):
    file = tmp_path / "truth.nc"
    exact.to_netcdf(file, engine="h5netcdf")
    assert main(["judge", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["judged"] == 3
