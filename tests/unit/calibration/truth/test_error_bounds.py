"""Bounds from the truth of other layouts: what they are made of, and what they cover of layouts alike."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.truth import Verdict, bound_for, coverage_by, scales
from calibration.truth.error_bounds import NODES, BoundError
from rodmodel import Layout

PITCHES = (2e-3, 3e-3, 4e-3, 5e-3, 6e-3)


def layout(pitch: float) -> Layout:
    return Layout("double-helix", 0.0, pitch)


def verdict_of(
    role: list[str], pitch: list[float], angle: np.ndarray, moment: np.ndarray, error: np.ndarray
) -> Verdict:
    """States whose angle errs by `error` [rad] and whose tip by as many hundredths of a metre."""
    count = len(role)
    zero = np.zeros(count)
    layouts = np.full(count, None, dtype=object)
    layouts[:] = [layout(one) for one in pitch]
    return Verdict(
        case=np.array([f"case{k}" for k in range(count)], dtype=object),
        role=np.array(role, dtype=object),
        pressure=np.stack([30e3 * angle, zero, zero], axis=1),
        loaded=moment > 0.0,
        judged=np.ones(count, dtype=bool),
        angle=np.full(count, 1.0),
        rod_angle=angle,
        tip=zero,
        angle_error=error,
        plane_error=zero,
        response=zero,
        volume=np.zeros((count, 3)),
        stated=np.full(count, 0.02),
        stated_tip=np.full(count, np.nan),
        base_moment=moment,
        turn_by_moment=np.full(count, 100.0),
        way_by_moment=np.full(count, 5.0),
        served_by=layouts,
        angle_off=error,
        tip_off=1e-2 * error,
        mesh_known=np.ones(count, dtype=bool),
        copied=np.zeros(count, dtype=bool),
    )


def drawn(seed: int, states: int = 40) -> Verdict:
    """Errors that grow from 0.01 to 0.05 rad over half a turn of the rod, alike in all layouts."""
    random = np.random.default_rng(seed)
    roles, pitches, angles, errors = [], [], [], []
    for role in ("fit", "judge"):
        for pitch in PITCHES:
            angle = random.uniform(0.0, np.pi, states)
            roles += [role] * states
            pitches += [pitch] * states
            angles.append(angle)
            errors.append((0.01 + 0.04 * angle / np.pi) * np.abs(random.standard_normal(states)))
    count = len(roles)
    return verdict_of(roles, pitches, np.concatenate(angles), np.zeros(count), np.concatenate(errors))


def rows_of(verdict: Verdict, role: str, pitch: float) -> np.ndarray:
    return (verdict.role == role) & np.array([one.pitch == pitch for one in verdict.served_by])


def test_the_bound_covers_nine_in_ten_states_of_a_layout_that_it_has_not_seen():
    shares = []
    for seed in range(40):
        verdict = drawn(seed)
        bound, note = bound_for(verdict, scales(verdict), layout(3e-3))
        shares.append(note["own_judge_states"]["angle"])
        assert note["own_judge_states"]["tip"] == pytest.approx(shares[-1])
        assert bound.bending_angle == NODES
    # The mean over 40 draws of 40 states has a standard error of 1 %.
    assert np.mean(shares) == pytest.approx(0.9, abs=0.03)


def test_the_bound_follows_how_the_error_grows_with_the_bend():
    verdict = drawn(1, states=400)
    bound, _ = bound_for(verdict, scales(verdict), layout(3e-3))
    # 90 % of a half normal distribution are below 1.645.
    for angle in (0.3, 1.5, 3.0):
        expected = 1.645 * (0.01 + 0.04 * angle / np.pi)
        for total in (0.0, 90e3):
            assert bound.at(total, bending_angle=angle)[0] == pytest.approx(expected, rel=0.12)


def test_nothing_of_a_layouts_own_judge_states_is_in_its_bound():
    verdict = drawn(2)
    changed = verdict.angle_off.copy()
    changed[rows_of(verdict, "judge", 3e-3)] *= 10.0
    other = replace(verdict, angle_off=changed)
    (mine, note), (same, worse) = (bound_for(one, scales(one), layout(3e-3)) for one in (verdict, other))
    assert same == mine
    assert worse["own_judge_states"]["angle"] < 0.5 < note["own_judge_states"]["angle"]
    assert bound_for(other, scales(other), layout(4e-3))[0].largest_angle > mine.largest_angle


def test_each_other_layout_has_the_same_weight_however_many_states_it_has():
    """Ten states of a worse layout tell the same as each of them four times, and more than none."""
    verdict = drawn(3)
    worse = np.flatnonzero(rows_of(verdict, "judge", 6e-3))
    errors, bent = 5.0 * verdict.angle_off, verdict.rod_angle.copy()
    errors = np.where(rows_of(verdict, "judge", 6e-3), errors, verdict.angle_off)
    errors[worse], bent[worse] = np.tile(errors[worse[:10]], 4), np.tile(bent[worse[:10]], 4)
    many = replace(verdict, angle_off=errors, rod_angle=bent)
    kept = np.ones(len(errors), dtype=bool)
    kept[worse[10:]] = False
    few = replace(many, judged=kept.copy())
    kept[worse] = False
    none = replace(many, judged=kept.copy())
    with_few, with_many, without = (
        bound_for(one, scales(one), layout(3e-3))[1]["factor"]["angle"] for one in (few, many, none)
    )
    assert with_few == pytest.approx(with_many, rel=1e-12)
    # Of no quarter less, and of some far more.
    assert np.min(np.divide(with_few, without)) >= 1.0
    assert np.max(np.divide(with_few, without)) > 1.4


def test_images_and_states_of_an_unknown_mesh_tell_nothing():
    verdict = drawn(4)
    wild = rows_of(verdict, "judge", 4e-3)
    copied = replace(verdict, angle_off=np.where(wild, 9.0, verdict.angle_off), copied=wild)
    unknown = replace(verdict, angle_off=np.where(wild, np.nan, verdict.angle_off))
    without = replace(verdict, judged=~wild)
    bounds = [bound_for(one, scales(one), layout(3e-3))[0] for one in (copied, unknown, without)]
    assert bounds[0] == bounds[1] == bounds[2]


def test_loads_add_what_the_compliance_errs_by_or_what_runs_show():
    verdict = drawn(5)
    scale = scales(verdict)
    free = verdict.role == "fit"
    relative = np.mean(verdict.angle_off[free])  # of an angle of 1 rad
    assert scale["angle"].per_moment == pytest.approx(100.0 * relative, rel=1e-6)
    assert scale["tip"].per_moment == pytest.approx(5.0 * relative, rel=1e-6)
    loaded = free & (np.arange(len(free)) % 4 == 0)
    moment = np.where(loaded, 3e-3, 0.0)
    more = replace(
        verdict,
        loaded=loaded,
        base_moment=moment,
        angle_off=verdict.angle_off + 100.0 * moment,
    )
    assert scales(more)["angle"].per_moment == pytest.approx(100.0, rel=0.2)


def test_runs_that_tell_no_bound_are_refused():
    verdict = drawn(6)
    with pytest.raises(BoundError, match="got 0 states of fit runs"):
        scales(replace(verdict, role=np.full(len(verdict.role), "judge", dtype=object)))
    alone = replace(verdict, judged=rows_of(verdict, "judge", 3e-3) | (verdict.role == "fit"))
    with pytest.raises(BoundError, match="no judge states of other layouts than double-helix, pitch 3 mm"):
        bound_for(alone, scales(alone), layout(3e-3))


def test_coverage_is_counted_by_layout_and_by_fifth():
    verdict = drawn(7)
    shares = coverage_by(verdict)
    judged = verdict.role == "judge"
    assert shares["all"] == {
        "states": 200,
        "angle": float((verdict.angle_off[judged] <= 0.02).mean()),
        "tip": None,
    }
    assert list(shares["layouts"]) == [f"double-helix, pitch {1e3 * p:g} mm, ψ = 0°" for p in PITCHES]
    assert [row["states"] for row in shares["layouts"].values()] == [40] * 5
    assert [row["states"] for row in shares["fifths"]] == [40] * 5
    ends = [end for row in shares["fifths"] for end in row["pressure_sum_kpa"]]
    assert ends == sorted(ends)
    # Errors grow with the pressures, and the stated bound does not.
    assert shares["fifths"][0]["angle"] > shares["fifths"][4]["angle"]
    assert shares["median_bound_below_30_kpa_deg"] == pytest.approx(np.rad2deg(0.02))
