"""The law of the paper's actuator, taken to half the size, against the period cell of that size."""

import numpy as np
import pytest

from calibration.similar import Scale, scaled
from fem_reference import Load, PeriodCell, follow
from fem_reference.design import read_design
from rodmodel import Layout, load, save_calibration, shipped_calibrations
from tests.unit.fem_reference.design.schema_file import ROOT

# Of the angle of the whole body: the law is as far from the cell that it was fitted to.
WITHIN = np.deg2rad(0.2)
PRESSURES = (10e3, 20e3, 30e3)


@pytest.mark.parametrize("chamber", [0, 1])
def test_free_bending_of_half_the_size_is_its_cells(chamber, tmp_path):
    design = read_design(ROOT / "designs" / "half.toml")
    paper = next(c for c in shipped_calibrations() if c.layout == Layout("double-helix", 0.0, 3e-3))
    save_calibration(scaled(paper, Scale(0.5, 1.0), paper.provenance), tmp_path / "half.json")
    section = load("double-helix", 0.0, 1.5e-3, tmp_path / "half.json").section
    ways = np.eye(3)[chamber]
    # The mesh of the law.
    cell = PeriodCell.of(design, "coarse")
    loads = [Load(tuple((p * ways).tolist())) for p in PRESSURES]
    for pressure, state in zip(PRESSURES, follow(cell, loads), strict=True):
        found = np.asarray(section.free_curvature(pressure * ways))
        length = design.geometry.body_length
        np.testing.assert_allclose(length * found, length * state.curvature, rtol=0.0, atol=WITHIN)
