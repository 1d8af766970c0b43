"""The laws that ship keep what is asked of a map: by their files' figures, which `report` finds again."""

import math

import pytest

import rodmodel

LAWS = {
    f"{c.layout.name} psi {c.layout.psi} pitch {1e3 * c.layout.pitch:g}": c
    for c in rodmodel.shipped_calibrations()
}
# Held out: 95 % and worst of the free bending angle [deg]; 95 % of moment and volume over their ranges.
ANGLE, WORST, MOMENT, VOLUME = 0.5, 2.0, 0.01, 0.01
# Of a law of a finer mesh, which is fitted near another to a fifth of the states.
MOMENT_NEAR = 0.015
# Beyond their bars: fitted to some 200 to 300 states of the fine mesh of their own, which are too few.
SHORT_OF_STATES = (
    "double-helix psi None pitch 3",
    "double-helix psi 1.5707963267948966 pitch 3",
    "six-helix psi 0.0 pitch 3",
)
too_few = pytest.mark.xfail(strict=True, reason="too few states of the fine mesh")


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=too_few) if n in SHORT_OF_STATES else n for n in LAWS]
)
def test_the_free_bending_angle_is_within_its_bar_at_95_percent(name: str) -> None:
    assert math.degrees(LAWS[name].error["free_bending_angle_rad"]["p95"]) <= ANGLE


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=too_few) if n in SHORT_OF_STATES[::2] else n for n in LAWS]
)
def test_worst_angle_moment_and_volume_are_within_their_bars(name: str) -> None:
    error = LAWS[name].error
    moment, volume = error["moment_nm"], error["volume_m2"]
    assert math.degrees(error["free_bending_angle_rad"]["worst"]) <= WORST
    bar = MOMENT if LAWS[name].provenance["mesh"] == "coarse" else MOMENT_NEAR
    assert moment["p95"] <= bar * moment["range"]
    assert volume["p95"] <= VOLUME * volume["range"]


@too_few
def test_the_law_of_all_orientations_errs_within_twice_what_those_of_one_do() -> None:
    """Its held-out paths are at random orientations, of which none was trained on."""
    helices = [c for c in LAWS.values() if c.layout.name == "double-helix" and c.layout.pitch == 3e-3]
    (of_all,) = (c for c in helices if c.layout.psi is None)
    single = [c for c in helices if c.layout.psi is not None]
    assert len(single) == 3
    for figure in ("median", "p95", "worst"):
        for quantity in ("free_bending_angle_rad", "moment_nm", "volume_m2"):
            best = min(c.error[quantity][figure] for c in single)
            assert of_all.error[quantity][figure] <= 2.0 * best
