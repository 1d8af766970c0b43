"""Each example runs as it stands: two in processes of their own, those that draw or tell in this one.

Those that draw a figure from stored points have a slow test but for one, as what they share is one module.
"""

import json
import re
import runpy
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import rodmodel
from fem_reference import MeshLevel

ROOT = Path(__file__).parents[2]


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    return tmp_path / "pictures" / "bent.png"


def test_01_predict_prints_the_bending_and_draws_it(picture: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-W", "error", str(ROOT / "examples" / "01_predict.py"), str(picture)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    rows = [line.split("│")[1:-1] for line in run.stdout.splitlines() if line.startswith("│")]
    assert [float(row[0]) for row in rows] == [10, 20, 30, 40, 50]
    angles, planes = ([float(row[column]) for row in rows] for column in (1, 2))
    assert angles == sorted(angles)
    assert 5.0 < angles[0] < angles[-1] < 180.0
    # Chamber 1 alone bends in the plane of its middle, towards -x.
    assert planes == [0.0] * 5
    tips = [[float(x) for x in row[3].split()] for row in rows]
    assert all(x < 0.0 and y == 0.0 for x, y, _ in tips)
    volumes = [[float(x) for x in row[4].split()] for row in rows]
    assert all(len(volume) == 3 and min(volume) > 0.0 for volume in volumes)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_02_period_cell_prints_angles_that_grow_and_draws_the_section(tmp_path: Path) -> None:
    drawn = tmp_path / "cell.png"
    command = [sys.executable, "-W", "error", str(ROOT / "examples" / "02_period_cell.py"), str(drawn)]
    run = subprocess.run(
        [*command, "--pressures-kpa", "4", "8"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    angles = [float(line.split(":")[1].split()[0]) for line in run.stdout.splitlines() if "kPa:" in line]
    # A prototype of the cell gave 5.0 degrees at 5 kPa.
    assert len(angles) == 2
    assert 3.0 < angles[0] < 5.0 < angles[1] < 10.0
    assert drawn.read_bytes().startswith(b"\x89PNG")


Run = Callable[..., str]


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """What an example prints, run in this process as if from its command line."""

    def run(name: str, *arguments: str) -> str:
        script = ROOT / "examples" / name
        monkeypatch.setattr(sys, "argv", [str(script), *arguments])
        monkeypatch.syspath_prepend(str(script.parent))
        runpy.run_path(str(script), run_name="__main__")
        return capsys.readouterr().out

    return run


def test_03_control_loop_tracks_the_circle_and_reports_its_deadlines(told: Run, tmp_path: Path) -> None:
    drawn = tmp_path / "loop.png"
    lines = {
        line[:18].strip(): line[18:]
        for line in told("03_control_loop.py", str(drawn), "--ticks", "200").splitlines()
    }
    assert lines["ticks"].startswith("200 of 1 ms")
    missed, share = re.fullmatch(r"(\d+) \(([\d.]+) %\)", lines["missed deadlines"]).groups()
    assert float(share) == pytest.approx(100.0 * int(missed) / 200)
    # A tick is 1.8 degrees of the circle, 1.3 degrees of bend: the loop is never one tick behind.
    assert float(lines["tracking error"].split()[0]) < 1.3
    assert drawn.read_bytes().startswith(b"\x89PNG")


def run_example(name: str, *arguments: str) -> str:
    """Output of an example in a process of its own, warnings as errors."""
    command = [sys.executable, "-W", "error", str(ROOT / "examples" / name), *arguments]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout


def errors(table: str) -> list[float]:
    """Of a figure's table, the rod's less the cell's angle [deg]."""
    return [float(error) for error in re.findall(r"\(([+-][\d.]+)\)", table)]


# Errors of the calibrations at these states, which free paths of the sweeps pass near: no more than the worst
# held-out one, nor than the bar of a map [deg]. The points are of the windings' own meshes, from which laws
# of the coarse mesh are farther; at 60 kPa the fine cell of ψ = 0, which three figures have, folds too early.
MAP_BAR = 2.0
COARSE = pytest.mark.xfail(
    strict=True, reason="laws of ψ = 0 and of pitches are of the coarse mesh: 2.7 to 7.7° off"
)


@pytest.mark.parametrize(
    ("name", "count"),
    [
        pytest.param("04_orientation.py", 30, marks=[pytest.mark.slow, COARSE]),
        pytest.param("05_pitch.py", 10, marks=[pytest.mark.slow, COARSE]),
        pytest.param("06_layouts.py", 9, marks=[pytest.mark.slow, COARSE]),
        pytest.param("07_one_and_two_chambers.py", 15, marks=COARSE),
    ],
)
def test_a_figure_has_points_the_rod_and_its_error(told: Run, tmp_path: Path, name: str, count: int) -> None:
    drawn = tmp_path / "figure.png"
    table = told(name, str(drawn))
    worst = max(float(c.error["free_bending_angle_rad"]["worst"]) for c in rodmodel.shipped_calibrations())
    found = errors(table)
    assert len(found) >= count
    assert max(map(abs, found)) < min(np.degrees(worst), MAP_BAR)
    assert drawn.read_bytes().startswith(b"\x89PNG")


def test_07_has_the_full_actuator_to_70_kpa_and_the_rods_error_beside_it(told: Run, tmp_path: Path) -> None:
    lines = told("07_one_and_two_chambers.py", str(tmp_path / "figure.png")).splitlines()
    first, second = (n for n, line in enumerate(lines) if line.startswith("full actuator"))
    assert lines[first].split()[-2:] == ["70", "kPa"]
    assert lines[second].split()[-2:] == ["57", "kPa"]
    runs = {line[:12].strip(): line for line in lines[first + 1 : first + 4]}
    # Chamber 1 keeps its plane, and the law goes on to there; the walls beside chambers 2 and 3 snap.
    assert len(re.findall(r"\[[+-][\d.]+\]", runs["chamber 1"])) == 4
    assert not runs["chamber 1"].rstrip().endswith("*")
    assert all(runs[name].rstrip().endswith("*") for name in ("chamber 2", "chamber 3"))


@pytest.mark.parametrize(
    ("name", "psi_deg", "pitch_mm"), [("double-helix", 0, 3), ("double-helix", 0, 4), ("ring", 0, 3)]
)
def test_the_curves_of_a_figure_are_as_long_as_the_domains(
    monkeypatch: pytest.MonkeyPatch, name: str, psi_deg: float, pitch_mm: float
) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    comparison = runpy.run_path(str(ROOT / "examples" / "figures" / "comparison.py"))
    wound = comparison["winding"](name, psi_deg, pitch_mm)
    way = (0.0, 1.0, 0.0)
    loading, *snapped = comparison["series"]("psi60", "chamber 2", wound, way).curves
    assert not loading.snapped
    assert 1e3 * loading.pressure[-1] == pytest.approx(wound.branches.loading.domain.reach(way))
    rods = [rod for branch, rod in wound.branches.snapped.items() if branch.chamber == 2]
    assert len(snapped) == len(rods)
    for curve, rod in zip(snapped, rods, strict=True):
        assert curve.snapped
        assert 1e3 * curve.pressure[-1] == pytest.approx(rod.domain.reach(way))
        assert 1e3 * curve.pressure[0] == pytest.approx(rod.domain.pressure_min[1], abs=300.0)


@pytest.mark.slow
def test_08_stiffness_rule_answers_with_numbers_and_their_uncertainty(told: Run, tmp_path: Path) -> None:
    drawn = tmp_path / "rule.png"
    lines = told("08_stiffness_rule.py", str(drawn)).splitlines()
    rows = [[float(x.rstrip(",")) for x in line.split()] for line in lines[1:5]]
    for kpa, correlation, *named, _best, least in rows:
        # At low pressure orientation hardly matters, and the ranking is noise.
        assert kpa < 40.0 or 0.5 < correlation <= 1.0
        assert least <= min(named) + 0.01
    assert "The map errs by up to" in lines[5]
    assert drawn.read_bytes().startswith(b"\x89PNG")


def test_09_against_measurement_puts_the_papers_deviations_beside_ours(told: Run) -> None:
    lines = told("09_against_measurement.py").splitlines()
    assert len(lines) == 7
    # The template's noise is 1°; planes of small bends scatter by more.
    for line in lines[1:]:
        assert float(line.split()[4]) < 15.0
    assert lines[2].split()[2] == "16.8"


@pytest.mark.slow
def test_00_cell_points_keeps_what_it_has_and_follows_what_it_lacks(tmp_path: Path) -> None:
    """Two states of a path, a few seconds."""
    file = tmp_path / "points.json"
    file.write_text(json.dumps({"psi0": {"kept": True}}))
    printed = run_example("points/cell_points.py", str(file), "--only", "psi0", "ring", "--last-kpa", "10")
    held = json.loads(file.read_text())
    assert held["psi0"] == {"kept": True}
    assert held["ring"]["pressure_kpa"] == [5.0, 10.0]
    assert 4.0 < held["ring"]["angle_deg"][0] < held["ring"]["angle_deg"][1] < 12.0
    assert "2 paths in" in printed


@pytest.mark.slow
def test_00_moment_points_go_both_ways_from_the_free_state(tmp_path: Path) -> None:
    """Without pressure, with the stiffness that the section has at rest, one way and the other."""
    file = tmp_path / "points.json"
    names = [f"double-helix-chamber1-0-{way}" for way in ("on", "back")]
    run_example("points/moment_points.py", str(file), "--only", *names)
    on, back = (json.loads(file.read_text())[name] for name in names)
    assert on["moment_nmm"] == pytest.approx([0.0, 0.6, 1.2, 1.8, 2.4, 3.0], abs=1e-6)
    assert back["moment_nmm"] == pytest.approx([-m for m in on["moment_nmm"]], abs=1e-6)
    assert on["curvature_per_m"] == sorted(on["curvature_per_m"])
    # EI is 2.4e-4 to 2.5e-4 N m² at rest.
    assert on["curvature_per_m"][1] == pytest.approx(0.6e-3 / 2.45e-4, rel=0.05)
    assert back["curvature_per_m"][1] == pytest.approx(-on["curvature_per_m"][1], rel=0.05)


@pytest.mark.slow
def test_00_actuator_frames_keep_the_skin_of_each_state(tmp_path: Path) -> None:
    """The first state of chamber 1, on a mesh of 1 800 hexahedra."""
    script = runpy.run_path(str(ROOT / "examples" / "points" / "actuator_frames.py"))
    level = MeshLevel(4, 8, 2, 4, 1, 1, 1, 2.0)
    script["follow"]("chamber1", tmp_path, level, last=1)
    with np.load(tmp_path / "frames-chamber1.npz") as frames:
        skin = frames["grain"] * frames["skin"][0]
        assert frames["pressure"].tolist() == [[5e3, 0.0, 0.0]]
        assert skin.shape[1] == level.around
        # The base is a circle of 12 mm on the ground, the last ring is about the tip.
        np.testing.assert_allclose(np.linalg.norm(skin[0], axis=1), 6e-3, atol=1e-5)
        np.testing.assert_allclose(skin[-1].mean(axis=0), frames["tip"][0], atol=2e-5)
        assert 3.0 < np.rad2deg(frames["angle"][0]) < 6.0
    assert [file.name for file in tmp_path.iterdir()] == ["frames-chamber1.npz"]


@pytest.mark.slow
def test_11_animation_draws_rod_and_elements_and_tells_how_far_apart(told: Run, tmp_path: Path) -> None:
    moving, still = tmp_path / "moving.gif", tmp_path / "still.png"
    lines = told("11_animation.py", str(moving), str(still), "--every", "4").splitlines()
    apart = [float(line.split("%")[0].split()[-1]) for line in lines if "apart where" in line]
    assert len(apart) == 2
    first = lines[1 : next(n for n, line in enumerate(lines) if "apart where" in line)]
    assert float(first[-1].split()[0]) == 70.0
    assert not any("beyond the calibration" in line for line in first)
    # Of a turn at 40 kPa; the rod's bar against the full actuator is 2 % of the length.
    assert apart[1] < 2.0
    assert moving.read_bytes().startswith(b"GIF8")
    assert still.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_11_the_rod_of_the_animation_is_within_its_bar(told: Run, tmp_path: Path) -> None:
    lines = told(
        "11_animation.py", str(tmp_path / "m.gif"), str(tmp_path / "s.png"), "--every", "4"
    ).splitlines()
    apart = [float(line.split("%")[0].split()[-1]) for line in lines if "apart where" in line]
    assert max(apart) < 2.0


@pytest.mark.slow
def test_00_twin_points_are_of_an_actuator_with_one_thicker_wall(monkeypatch: pytest.MonkeyPatch) -> None:
    """Chamber 1 at 5 kPa, on a mesh of 1 800 hexahedra: the thick wall is its own."""
    monkeypatch.syspath_prepend(str(ROOT / "examples" / "points"))
    script = runpy.run_path(str(ROOT / "examples" / "points" / "twin_points.py"))
    level = MeshLevel(4, 8, 2, 4, 1, 1, 1, 2.0)
    first, second = (
        script["trace"]((name, way, (5.0,)), level)
        for name, way in (("chamber1", (1.0, 0.0, 0.0)), ("chamber2", (0.0, 1.0, 0.0)))
    )
    assert first["pressure_kpa"] == [[5.0, 0.0, 0.0]]
    assert 3.0 < first["angle_deg"][0] < second["angle_deg"][0] < 6.0


@pytest.mark.slow
def test_12_twin_halves_its_error(told: Run, tmp_path: Path) -> None:
    drawn = tmp_path / "twin.png"
    lines = told("12_twin.py", str(drawn)).splitlines()
    at = next(n for n, line in enumerate(lines) if line.startswith("adjusted over map"))
    assert [line.split()[0] for line in lines[1:at]] == ["chamber1", "chamber2", "pair23", "chamber3"]
    angle, tip = (float(part.split()[-1]) for part in lines[at + 1].split(","))
    assert 0.0 < angle <= 0.5
    assert 0.0 < tip <= 0.5
    assert drawn.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_10_moment_curvature_errs_by_less_than_held_out_states_do(told: Run, tmp_path: Path) -> None:
    drawn = tmp_path / "maps.png"
    lines = told("10_moment_curvature.py", str(drawn)).splitlines()
    middle = next(n for n, line in enumerate(lines) if line.startswith("law − middle"))
    rows, runs = lines[1:middle], lines[middle + 1 : -1]
    drawn_laws = [c for c in rodmodel.shipped_calibrations() if (c.layout.psi, c.layout.pitch) == (0.0, 3e-3)]
    assert len(drawn_laws) == 3
    worst = max(float(c.error["loaded_bending_angle_rad"]["worst"]) for c in drawn_laws)
    assert len(rows) == 12
    assert max(float(row.split()[-3]) for row in rows) < np.degrees(worst)
    assert [run.rpartition(",")[0] for run in runs] == list(dict.fromkeys(r.rpartition(",")[0] for r in rows))
    assert runs[0].split()[-3:-1] == ["70", "kPa"]
    assert drawn.read_bytes().startswith(b"\x89PNG")


def test_13_hysteresis_goes_up_and_down_along_both_branches(told: Run, tmp_path: Path) -> None:
    drawn = tmp_path / "loop.png"
    lines = told("13_hysteresis.py", str(drawn)).splitlines()
    form = re.compile(r"(up|down)\s+(loading|snapped|not calibrated)\s+([\d.]+) to\s+([\d.]+) kPa,")
    stretches = [form.match(line).groups() for line in lines[:-1]]
    names = [(way, name) for way, name, *_ in stretches]
    assert [name for name in names if name[1] != "not calibrated"] == [
        ("up", "loading"),
        ("up", "snapped"),
        ("down", "snapped"),
        ("down", "loading"),
    ]
    ends = [(float(first), float(last)) for *_, first, last in stretches]
    assert (ends[0][0], ends[-1][1]) == (0.0, 0.0)
    assert max(max(pair) for pair in ends) == 70.0
    # One after the other, without a step left out.
    assert all(abs(before[1] - after[0]) <= 0.5 for before, after in pairwise(ends))
    assert drawn.read_bytes().startswith(b"\x89PNG")
