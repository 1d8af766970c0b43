"""The picture: written in each format, with what it says."""

from pathlib import Path

import matplotlib
import numpy as np
import pytest

from rodmodel.plot import plot_rod
from tests.unit.rodmodel import synthetic

PRESSURES = [np.array([10e3, 0.0, 0.0]), np.array([60e3, 20e3, 0.0])]


@pytest.mark.parametrize("poses", [1, 2])
def test_a_picture_names_pressures_and_angles(
    tmp_path: Path, poses: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Text as text, not as outlines.
    monkeypatch.setitem(matplotlib.rcParams, "svg.fonttype", "none")
    rod = synthetic.rod(synthetic.bending_law())
    drawn = [(pressure, rod.solve(pressure)) for pressure in PRESSURES[-poses:]]
    plot_rod(drawn, rod.actuator, tmp_path / "bent.svg")
    text = (tmp_path / "bent.svg").read_text()
    for pressure, solution in drawn:
        assert f"θ = {np.degrees(solution.bending_angle):.1f}°" in text
        assert " / ".join(f"{1e-3 * p:g}" for p in pressure) + " kPa" in text
    assert "chamber 3: 0 kPa" in text
    assert text.count("[mm]") >= 4


@pytest.mark.parametrize(("name", "start"), [("a.png", b"\x89PNG"), ("a.pdf", b"%PDF")])
def test_the_suffix_is_the_format(tmp_path: Path, name: str, start: bytes) -> None:
    rod = synthetic.rod(synthetic.bending_law())
    plot_rod([(np.zeros(3), rod.solve(np.zeros(3)))], rod.actuator, tmp_path / name)
    assert (tmp_path / name).read_bytes().startswith(start)


def test_a_place_that_cannot_be_written_raises(tmp_path: Path) -> None:
    rod = synthetic.rod(synthetic.bending_law())
    with pytest.raises(OSError, match="No such file"):
        plot_rod([(np.zeros(3), rod.solve(np.zeros(3)))], rod.actuator, tmp_path / "no" / "a.png")
