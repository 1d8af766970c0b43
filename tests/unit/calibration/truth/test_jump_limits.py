"""Pressures between which runs under one chamber left their loading branch."""

import numpy as np
import pytest
import xarray as xr

from calibration.truth import SHIPPED
from calibration.truth.jump_limits import jump_limits
from rodmodel import Layout
from rodmodel.io import Jump


@pytest.fixture(scope="module")
def truth() -> xr.Dataset:
    return xr.load_dataset(SHIPPED, engine="h5netcdf")


def zero(pitch: float = 3e-3) -> Layout:
    return Layout("double-helix", 0.0, pitch)


def test_runs_that_jumped_say_between_which_pressures(truth: xr.Dataset) -> None:
    """Chamber 1's run is held in its plane, and tells nothing of a jump aside; fit runs end before."""
    assert jump_limits(truth, zero()) == (
        Jump(2, 60e3, 65e3, "chamber2", "coarse"),
        Jump(3, 65e3, 70e3, "chamber3", "coarse"),
    )


def test_at_90_degrees_all_three_jump(truth: xr.Dataset) -> None:
    found = jump_limits(truth, Layout("double-helix", np.pi / 2, 3e-3))
    assert [(jump.chamber, jump.stood, jump.jumped) for jump in found] == [
        (chamber, 60e3, 70e3) for chamber in (1, 2, 3)
    ]


def test_a_chamber_without_a_jump_has_the_run_that_went_on_most(truth: xr.Dataset) -> None:
    rows = np.isin(truth["case"].values, ["chamber2", "chamber2-fit"])
    upright = truth.isel(state=np.flatnonzero(rows & (truth["pressure"].values[:, 1] < 63e3)))
    assert jump_limits(upright, zero()) == (Jump(2, 60e3, None, "chamber2", "coarse"),)


def test_a_law_of_all_orientations_and_another_pitch_have_none(truth: xr.Dataset) -> None:
    assert jump_limits(truth, Layout("double-helix", None, 3e-3)) == ()
    assert jump_limits(truth, zero(5e-3)) == ()
