"""Each example runs as it stands."""

import subprocess
import sys
from pathlib import Path

import pytest

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


def test_03_control_loop_tracks_the_circle_and_reports_its_deadlines(tmp_path: Path) -> None:
    drawn = tmp_path / "loop.png"
    command = [sys.executable, "-W", "error", str(ROOT / "examples" / "03_control_loop.py"), str(drawn)]
    run = subprocess.run([*command, "--ticks", "200"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    lines = {line[:18].strip(): line[18:] for line in run.stdout.splitlines()}
    assert lines["ticks"].startswith("200 of 1 ms")
    assert 0 <= int(lines["missed deadlines"].split()[0]) <= 200
    # A tick is 1.8 degrees of the circle, 1.3 degrees of bend: the loop is never one tick behind.
    assert float(lines["tracking error"].split()[0]) < 1.3
    assert drawn.read_bytes().startswith(b"\x89PNG")
