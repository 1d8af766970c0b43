"""Torsional stiffness of the laws that ship, against the limit of fine meshes: within 10 %."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

import rodmodel
from calibration.truth import layout_of
from tests.benchmark.refinement.limits import limit
from tests.benchmark.refinement.meshes import WINDINGS
from tests.benchmark.refinement.report import gathered
from tests.benchmark.refinement.solve import ONE, TWO

STUDY = gathered(None)
BAR = 0.10
six = pytest.mark.xfail(
    strict=True, reason="−17 % at rest, 14 % at 50 kPa: few fine states, few of them twist"
)


def cases() -> list[Any]:
    """Windings of the study, with each calibration that serves them."""
    found = []
    for name in STUDY:
        own = layout_of(WINDINGS[name].winding)
        for calibration in rodmodel.shipped_calibrations():
            layout = calibration.layout
            alike = layout.name == own.name and layout.pitch == pytest.approx(own.pitch)
            # Of pitch 4 the study has no limit yet.
            if name != "pitch 4" and alike and (layout.psi is None or layout.psi == pytest.approx(own.psi)):
                of = "of all ψ" if layout.psi is None else "of its own"
                marks = [six] if name == "six helices" else []
                found.append(pytest.param(name, calibration, id=f"{name} {of}", marks=marks))
    return found


@pytest.mark.parametrize(("name", "calibration"), cases())
def test_it_is_that_of_the_limit_along_one_chamber_and_two(
    name: str, calibration: rodmodel.Calibration
) -> None:
    """`limit` has an interval of 1 to 8 %; its middle is taken."""
    law = calibration.section_law
    if isinstance(law, rodmodel.OrientedNetwork):
        law = law.at_psi(layout_of(WINDINGS[name].winding).psi)
    off = []
    for path, pressures, chambers in (("chamber 1", ONE, (1, 0, 0)), ("chambers 1+2", TWO, (1, 1, 0))):
        for kpa in pressures:
            known = limit(STUDY[name], path, kpa, "torsion")
            pressure = 1e3 * kpa * jnp.array(chambers)
            if known is not None and calibration.domain.covers_pressure(np.asarray(pressure)):
                contracted = law.at(pressure)
                found = float(contracted.stiffness(contracted.free_curvature)[2, 2])
                off.append(abs(known.error(found)))
    assert len(off) >= 7
    assert max(off) < BAR, off
