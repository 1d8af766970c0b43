"""Stored runs come out as they did, to what the solver leaves."""

import json

import numpy as np
import pytest

from tests.ground_truth.gold import FILE, runs


@pytest.mark.slow
def test_gold_runs_come_out_as_they_did():
    gold = json.loads(FILE.read_text())
    found = dict(runs())
    assert found.keys() == gold.keys()
    for name, answer in found.items():
        kept = gold[name]
        for key in answer:
            # No walls touch: forces of 1e-9 N are left of 1e-2 N, or steps of 1e-6 mm of 1 mm. A curvature
            # that is zero by symmetry is judged beside 1 1/m.
            scale = max(np.abs(kept[key]).max(), 1.0 if key == "curvature_per_m" else 0.0)
            np.testing.assert_allclose(answer[key], kept[key], rtol=0, atol=1e-6 * scale, err_msg=name)
