"""The twin experiment: fit-measured on the finite elements of an actuator with one wall a tenth thicker."""

import runpy
from pathlib import Path

import numpy as np
import pytest

# Ten fits; `unit/calibration/measured/test_fit.py` has known parameters come back.
pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[2] / "examples"
DRAWS = 10


@pytest.fixture(scope="module")
def twins():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(EXAMPLES))
        script = runpy.run_path(str(EXAMPLES / "12_twin.py"))
        yield [script["run"](seed) for seed in range(DRAWS)]


def test_the_adjusted_map_errs_by_half_as_much_at_most(twins):
    """Against the actuator itself, with 3 % noise on what was measured; the median of ten draws of it."""
    angle, tip = np.median([twin.ratios() for twin in twins], axis=0)
    assert angle <= 0.5
    assert tip <= 0.5


def test_the_noise_is_told_from_the_residuals(twins):
    """Tip positions scatter by 3 % of the tip's way: 0.2 to 1.5 mm, of which the fit sees the mean square."""
    scale = np.median([twin.fit.noise_scale for twin in twins])
    assert 0.3 < scale < 3.0
