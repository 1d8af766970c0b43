"""Where the fit of a design's law begins, which fit wins, and that it is kept."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from calibration.fit import Judged
from calibration.from_design import Budget, StageError, Task
from calibration.from_design import fit_stage as stage
from calibration.from_design.near_law import near_laws
from calibration.sweep import attributes, save_dataset
from fem_reference import Design
from rodmodel import Layout, shipped_calibrations

NEAR = near_laws(Design())
OWN = next(c for c in shipped_calibrations() if c.layout == Layout("double-helix", 0.0, 3e-3))


TITLE = "double-helix, pitch 3 mm, ψ = 0°"
BEGUN = [f"near {TITLE}", f"close to {TITLE}", f"{TITLE}, its scales alone"]


def task_in(directory: Path, budget: str = "20min") -> Task:
    return Task(Design(), Budget.parse(budget), directory, "the command")


def judged(p95: float, good: bool = True) -> Judged:
    error = {**OWN.error, "free_bending_angle_rad": {**OWN.error["free_bending_angle_rad"], "p95": p95}}
    return Judged(OWN.section_law, OWN.domain, error, {"states": 50}, 60, good, "" if good else "it has none")


@pytest.mark.parametrize(
    ("budget", "states", "titles"),
    [
        ("20min", 2000, BEGUN),
        ("1h", 100, BEGUN),
        ("1h", 2000, [*BEGUN, "from scratch"]),
    ],
)
def test_a_fit_from_scratch_needs_time_and_states(tmp_path, dataset, budget, states, titles):
    starts = stage.starts_for(task_in(tmp_path, budget), NEAR, attributes(dataset), states)
    assert [start.title for start in starts] == titles


def test_a_law_of_less_symmetry_is_passed_over(tmp_path, dataset):
    """A section that is the same from all chambers begins near one that is, or from scratch."""
    run = {**attributes(dataset), "layout": "ring"}
    starts = stage.starts_for(task_in(tmp_path), NEAR, run, 100)
    assert starts[0].title.startswith(("near ring", "near six-helix"))
    helices = [near for near in NEAR if "double-helix" in near.title]
    assert [s.title for s in stage.starts_for(task_in(tmp_path), helices, run, 100)] == ["from scratch"]


@pytest.mark.parametrize(
    ("of_near", "of_scratch", "wins"), [(0.01, 0.02, "near"), (0.02, 0.01, "from scratch")]
)
def test_the_less_held_out_error_wins_and_is_kept(tmp_path, dataset, monkeypatch, of_near, of_scratch, wins):
    file, fits = tmp_path / "dataset.nc", []
    save_dataset(dataset, file)

    def fit(*arguments, near, stay):
        fits.append(arguments)
        return judged(of_near if near else of_scratch)

    monkeypatch.setattr(stage, "fit_and_judge", fit)
    monkeypatch.setattr(stage, "_ENOUGH", 1)
    task = task_in(tmp_path, "1h")
    first = stage.fitted(task, dataset, file, OWN.domain, NEAR, 5)
    assert first.provenance["fit_start"].startswith(wins)
    assert first.error["free_bending_angle_rad"]["p95"] == min(of_near, of_scratch)
    again = stage.fitted(task, dataset, file, OWN.domain, NEAR, 5)
    assert len(fits) == 4
    # The third is the similar law with its scales fitted.
    assert [arguments[5] for arguments in fits] == [5, 5, 0, 5]
    assert again.provenance == first.provenance
    stage.fitted(task, dataset, file, OWN.domain, NEAR, 6)
    assert len(fits) == 8


def test_a_narrower_domain_does_not_win_by_its_errors():
    """Its states are easier. Where all are as narrow, the errors decide."""
    narrow = replace(judged(0.001), domain=replace(OWN.domain, pressure_max=(20e3, 20e3, 20e3)))
    start = stage.Start("one", None)
    assert stage.best_of([(start, narrow), (start, judged(0.02))])[1].domain == OWN.domain
    assert stage.best_of([(start, narrow), (start, replace(narrow, error={}))])[1] is narrow


def test_a_damaged_law_is_fitted_again(tmp_path, dataset, monkeypatch):
    file = tmp_path / "dataset.nc"
    save_dataset(dataset, file)
    monkeypatch.setattr(stage, "fit_and_judge", lambda *_, **__: judged(0.01))
    task = task_in(tmp_path)
    stage.fitted(task, dataset, file, OWN.domain, NEAR, 5)
    (made,) = tmp_path.glob("law-*.json")
    made.write_text(made.read_text()[:100])
    assert stage.fitted(task, dataset, file, OWN.domain, NEAR, 5).layout == OWN.layout


def test_a_law_without_equilibrium_is_an_error(tmp_path, dataset, monkeypatch):
    file = tmp_path / "dataset.nc"
    save_dataset(dataset, file)
    monkeypatch.setattr(stage, "fit_and_judge", lambda *_, **__: judged(0.01, good=False))
    with pytest.raises(StageError, match="fit: it has none"):
        stage.fitted(task_in(tmp_path), dataset, file, OWN.domain, NEAR, 5)
    assert not list(tmp_path.glob("law-*"))


def test_without_free_bending_the_loaded_angle_decides():
    assert stage.held_out({"loaded_bending_angle_rad": {"p95": 0.3}}) == 0.3
    assert stage.held_out({}) == math.inf
