"""The shipped section law against live solves of the finite-element cell that it was calibrated on.

The file states how far the law was from the cell on held-out paths. What is solved here was in neither set,
and must be no farther than the worst of those: the tolerances are the file's own claims.
"""

import jax.numpy as jnp
import numpy as np
import pytest

import rodmodel
from calibration.truth import on_its_mesh
from fem_reference import CellState, DoubleHelix, Load, PeriodCell, follow

LENGTH = 60e-3
# Pressures [kPa] and moments [N mm], each reached from the one before.
LOADS = [
    ((6.0, 1.5, 0.0), (0.0, 0.0, 0.0)),
    ((18.0, 4.5, 0.0), (0.0, 0.0, 0.0)),
    ((18.0, 4.5, 0.0), (0.3, -0.5, 0.2)),
    ((27.0, 7.0, 11.0), (0.3, -0.5, 0.2)),
    ((27.0, 7.0, 11.0), (0.0, 0.0, 0.0)),
]


# Orientation and pitch of the winding, and whether the law is that of this one or of all orientations; the
# second has no path at just this orientation.
@pytest.fixture(
    scope="module",
    params=[
        pytest.param((0.0, 3e-3, False), id="psi 0"),
        pytest.param((0.35, 3e-3, True), id="psi 20 of all", marks=pytest.mark.slow),
        pytest.param((0.0, 2e-3, False), id="pitch 2", marks=pytest.mark.slow),
    ],
)
def winding(request: pytest.FixtureRequest) -> tuple[float, float, bool]:
    return request.param


@pytest.fixture(scope="module")
def states(winding: tuple[float, float, bool], calibration: rodmodel.Calibration) -> list[CellState]:
    """Equilibria of the cell, with the mesh and the ends of the calibration."""
    loads = [
        Load(tuple(1e3 * p for p in pressure), moment=tuple(1e-3 * m for m in moment))
        for pressure, moment in LOADS
    ]
    # Files of before the silicone could slide hold its length.
    compliance = calibration.provenance.get("end_compliance_m_per_n", 0.0)
    level = calibration.provenance["mesh"]
    cell = PeriodCell(winding=DoubleHelix(*winding[:2]), level=level, end_compliance=compliance)
    return list(follow(cell, loads))


@pytest.fixture(scope="module")
def calibration(winding: tuple[float, float, bool]) -> rodmodel.Calibration:
    """The shipped file of the winding, or of all its orientations, with the law of its mesh."""
    psi, pitch, of_all = winding
    wanted = ("double-helix", None if of_all else psi, pitch)
    (found,) = (
        c for c in rodmodel.shipped_calibrations() if (c.layout.name, c.layout.psi, c.layout.pitch) == wanted
    )
    return on_its_mesh(found)


@pytest.fixture(scope="module")
def law(winding: tuple[float, float, bool], calibration: rodmodel.Calibration) -> rodmodel.SectionLaw:
    found = calibration.section_law
    return found.at_psi(winding[0]) if isinstance(found, rodmodel.OrientedNetwork) else found


def test_loads_lie_in_the_domain(calibration: rodmodel.Calibration) -> None:
    """Else the rest of this file would judge an extrapolation."""
    for pressure, moment in LOADS:
        assert calibration.domain.covers_pressure([1e3 * p for p in pressure])
        assert calibration.domain.covers_moment(1e-3 * jnp.asarray(moment))


def test_free_curvature(
    states: list[CellState], law: rodmodel.SectionLaw, calibration: rodmodel.Calibration
) -> None:
    """Free bending of 60 mm is within the worst held-out error of the bending vector, in angle and plane."""
    worst = calibration.error["free_bending_vector_rad"]["worst"]
    free = [s for s, (_, moment) in zip(states, LOADS, strict=True) if not any(moment)]
    assert len(free) == 3
    for state in free:
        found = np.asarray(law.free_curvature(jnp.asarray(state.pressure)))
        assert LENGTH * np.linalg.norm(found[:2] - state.curvature[:2]) <= worst


def test_moment(states: list[CellState], law: rodmodel.SectionLaw, calibration: rodmodel.Calibration) -> None:
    """The law's moment at the cell's curvature is within the worst held-out error of the moment."""
    worst = calibration.error["moment_nm"]["worst"]
    for state in states:
        found = law.moment(jnp.asarray(state.curvature), jnp.asarray(state.pressure))
        assert np.linalg.norm(np.asarray(found) - state.moment) <= worst


def test_volume(states: list[CellState], law: rodmodel.SectionLaw, calibration: rodmodel.Calibration) -> None:
    """Chamber volumes at the cell's curvature are within the worst held-out error of the volumes."""
    worst = calibration.error["volume_m2"]["worst"]
    for state in states:
        found = law.volume(jnp.asarray(state.curvature), jnp.asarray(state.pressure))
        assert np.abs(np.asarray(found) - state.volume).max() <= worst


def test_stiffness(
    states: list[CellState], law: rodmodel.SectionLaw, calibration: rodmodel.Calibration
) -> None:
    """Bending stiffness agrees to the moment error over the curvature that it is spread over.

    A moment error e that varies over the moments of the domain, about ±m_max/K in curvature, has a slope of
    the order e K/m_max; twice that, by the 95th percentile of e, is taken.
    """
    error = calibration.error["moment_nm"]["p95"]
    for state in states:
        stiffness = state.hessian[:3, :3]
        found = np.asarray(law.stiffness(jnp.asarray(state.curvature), jnp.asarray(state.pressure)))
        spread = calibration.domain.moment_max / np.linalg.norm(stiffness, 2)
        assert np.linalg.norm(found - stiffness, 2) <= 2.0 * error / spread
