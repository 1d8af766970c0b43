"""Rods against the full actuator's runs that ship."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import rodmodel
from calibration.report import report_rods
from calibration.truth import SHIPPED, Verdict, compare_with_truth

# The windings that have ends of their own runs; the first one's serve the others.
PAPER, WIDEST = "double-helix, pitch 3 mm, ψ = 0°", "double-helix, pitch 6 mm, ψ = 0°"
QUARTER, SIX = "double-helix, pitch 3 mm, ψ = 90°", "six-helix, pitch 3 mm"
# Laws of the fine mesh, whose truth is of the coarse one and carried to the limit by the cell's ratio.
THIRD, TURNED = "double-helix, pitch 3 mm, ψ = 30°", "double-helix, pitch 3 mm, ψ = 45°"
# The worst tips of two are 3.20 and 2.27 % off.
CARRIED = (TURNED, SIX)
TIP = 2.0
# Tip of ψ = 0 below 52 kPa: no worse than the law that went no further, 1.26, and the rounding of it.
BELOW_52 = 1.31
# A path of three unequal pressures on which cells lean over, judged by itself.
LEANING = "triple-51-17-20"


@pytest.fixture(scope="module")
def truth() -> xr.Dataset:
    return xr.load_dataset(SHIPPED, engine="h5netcdf")


@pytest.fixture(scope="module")
def verdict(truth: xr.Dataset) -> Verdict:
    return compare_with_truth(truth)


def below(verdict: Verdict, pressure: float) -> Verdict:
    """The verdict on states without a larger pressure [Pa]."""
    return replace(verdict, judged=verdict.judged & (verdict.pressure.max(axis=1) <= pressure))


def leaning(verdict: Verdict, yes: bool = True) -> Verdict:
    """The verdict on the runs whose sections lean, or on all others."""
    of = np.char.endswith(verdict.case.astype(str), LEANING)
    return replace(verdict, judged=verdict.judged & (of == yes))


def test_tips_over_the_whole_range_are_as_near_as_is_asked(verdict: Verdict) -> None:
    """All windings, single chambers to 70 kPa and pairs to 50."""
    tips = report_rods(verdict)["all"]["tip_percent"]
    assert tips["median"] <= 0.7
    assert tips["p95"] <= 2.0
    assert tips["worst"] <= 4.0
    assert report_rods(verdict)[PAPER]["tip_percent"]["worst"] <= TIP
    assert report_rods(verdict)[THIRD]["tip_percent"]["worst"] <= TIP


def test_the_rod_is_as_near_as_the_documentation_says(verdict: Verdict) -> None:
    """Bounds of the issue's own: the rod of ψ = 0 against runs that nothing was fitted to."""
    fit, judge = report_rods(verdict, "fit"), report_rods(verdict)[PAPER]
    assert judge["judged"] >= 60
    assert set(fit) == {PAPER, WIDEST, SIX, "all"}
    # All but the pair 2+3 at 52 kPa, beyond what the law's domain leaves to two chambers.
    assert fit["all"]["judged"] == fit["all"]["states"] - 1
    assert judge["tip_percent"]["median"] <= 0.7
    assert judge["loaded_tip_percent"]["median"] <= 2.0
    assert judge["loaded_tip_percent"]["worst"] <= 3.5
    # If the length that the base lags by did not bend under a tip force either, a cantilever's way would be
    # 14 % less. Half of that tells the two apart.
    actuator = rodmodel.load("double-helix").actuator
    whole = actuator.body_length + actuator.cap_length
    stiffer = 1.0 - (1.0 - actuator.base_lag / whole) ** 3
    assert judge["response_percent"]["worst"] <= 50.0 * stiffer
    assert report_rods(leaning(below(verdict, 52e3), False))[PAPER]["tip_percent"]["worst"] <= BELOW_52
    assert judge["tip_percent"]["p95"] <= 2.0


@pytest.mark.xfail(
    strict=True, reason="0.42 %: the ends are of the whole range now, and pay for it below 52 kPa"
)
def test_the_rod_is_as_near_its_fit_runs_as_when_they_ended_at_50_kpa(verdict: Verdict) -> None:
    assert report_rods(verdict, "fit")[PAPER]["tip_percent"]["median"] <= 0.39


def test_rods_of_all_windings_are_within_the_worst_that_is_asked(verdict: Verdict) -> None:
    rods = report_rods(leaning(below(verdict, 54e3), False))
    assert rods["all"]["judged"] >= 100
    for name, figures in rods.items():
        assert name in (*CARRIED, "all") or figures["tip_percent"]["worst"] <= TIP, name
        assert figures["angle_deg"]["worst"] <= 3.0, name
        assert name in (TURNED, "all") or figures["plane_deg"]["worst"] <= 2.0, name


# At (51, 17, 20) kPa and ψ = 0 γ is 3.7° off; at ψ = 90° θ 3.7°, γ 4.3°, the tip 2.7 %.
leans = pytest.mark.xfail(strict=True, reason="the actuator leans by 0.7 of what its section does")


@pytest.mark.parametrize(
    ("name", "figure", "bar"),
    [
        (PAPER, "tip_percent", BELOW_52),
        (PAPER, "angle_deg", 3.0),
        pytest.param(PAPER, "plane_deg", 2.0, marks=leans),
        pytest.param(QUARTER, "tip_percent", TIP, marks=leans),
        pytest.param(QUARTER, "angle_deg", 3.0, marks=leans),
        pytest.param(QUARTER, "plane_deg", 2.0, marks=leans),
    ],
)
def test_rods_are_within_the_worst_that_is_asked_where_sections_lean(
    verdict: Verdict, name: str, figure: str, bar: float
) -> None:
    rods = report_rods(leaning(verdict))[name]
    assert rods["judged"] == 5
    assert rods[figure]["worst"] <= bar


@pytest.mark.xfail(strict=True, reason="the law errs by 1°, and planes are not carried to the law's mesh")
def test_planes_are_within_the_worst_that_is_asked_at_45_degrees(verdict: Verdict) -> None:
    assert report_rods(below(verdict, 54e3))[TURNED]["plane_deg"]["worst"] <= 2.0


@pytest.mark.xfail(
    strict=True, reason="no run of the actuator on the fine mesh yet: a ratio is to 1 % at best"
)
@pytest.mark.parametrize("name", CARRIED)
def test_rods_are_within_the_worst_that_is_asked_where_the_truth_is_carried_over(
    verdict: Verdict, name
) -> None:
    assert report_rods(verdict)[name]["tip_percent"]["worst"] <= TIP
