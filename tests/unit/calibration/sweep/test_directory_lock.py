"""One sweep at a time in a run directory."""

import pytest

from calibration.sweep.directory_lock import sole_sweep
from calibration.sweep.errors import SweepError


def test_a_second_sweep_in_the_same_directory_is_refused(tmp_path):
    with sole_sweep(tmp_path / "run"):
        with pytest.raises(SweepError, match="is in use by another sweep"), sole_sweep(tmp_path / "run"):
            pass
        with sole_sweep(tmp_path / "other"):
            pass


def test_a_sweep_that_ended_or_failed_leaves_the_directory_free(tmp_path):
    with pytest.raises(RuntimeError), sole_sweep(tmp_path):
        raise RuntimeError
    with sole_sweep(tmp_path):
        assert list(tmp_path.iterdir()) == []
