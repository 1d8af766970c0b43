"""Torsional stiffness of the laws that ship, against the limit of fine meshes: within 10 %."""

import numpy as np
import pytest

import rodmodel
from tests.benchmark.refinement.law_torsion import errors, pairs
from tests.benchmark.refinement.report import gathered

STUDY = gathered(None)
BAR = 0.10
six = pytest.mark.xfail(strict=True, reason="−26 to 9 %: few fine states, few of them twist")
CASES = [
    pytest.param(
        name, c, id=f"{name}, law of psi {c.layout.psi}", marks=[six] if name == "six helices" else []
    )
    for name, c in pairs(STUDY)
]


@pytest.mark.parametrize(("name", "calibration"), CASES)
def test_it_is_that_of_the_limit_along_one_chamber_and_two(
    name: str, calibration: rodmodel.Calibration
) -> None:
    """Of its interval, 0.1 to 8 %, the middle is taken. The laws were carried by the mean ratio there."""
    off = errors(STUDY, name, calibration)
    assert len(off) >= 7
    assert np.abs(off).max() < BAR


def test_all_windings_that_have_a_limit_are_there() -> None:
    of_any = [name for name, c in pairs(STUDY) if c.layout.psi is None]
    assert of_any == ["psi 90", "psi 0", "psi 45", "psi 60", "psi 30", "psi 12"]
    of_their_own = [name for name, c in pairs(STUDY) if c.layout.psi is not None]
    assert of_their_own == [
        *("psi 90", "rings", "six helices", "pitch 4"),
        *("psi 0", "pitch 2", "pitch 6", "psi 12"),
    ]
