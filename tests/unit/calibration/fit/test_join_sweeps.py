"""States of several sweeps fitted together."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from calibration.fit import UnlikeError, joined
from calibration.fit.same_section import refuse_unlike
from calibration.sweep import attributes
from fem_reference import Thread


def changed(dataset, **attrs):
    return dataset.assign_attrs({name: json.dumps(value) for name, value in attrs.items()})


def test_the_paths_of_two_sweeps_stay_apart(samples):
    both = joined([samples, samples.where(samples.held_out)])
    assert len(both) == len(samples) + samples.held_out.sum()
    assert len(np.unique(both.path)) == len(np.unique(samples.path)) + len(
        np.unique(samples.path[samples.held_out])
    )
    np.testing.assert_array_equal(both.hessian[: len(samples)], samples.hessian)
    np.testing.assert_array_equal(both.hessian[len(samples) :], samples.hessian[samples.held_out])


def test_sweeps_of_another_section_are_refused(dataset):
    refuse_unlike(dataset, dataset)
    winding = attributes(dataset)["winding"]
    for name, value in (
        ("layout", "ring"),
        ("geometry", {**attributes(dataset)["geometry"], "outer_wall": 1.1e-3}),
        ("end_compliance", 1e-3),
        ("winding", {**winding, "pitch": 4e-3}),
        ("winding", {**winding, "psi": 0.2}),
    ):
        with pytest.raises(UnlikeError, match=rf"a sweep with {name} .*, expected "):
            refuse_unlike(dataset, changed(dataset, **{name: value}))


def test_a_law_of_all_orientations_takes_sweeps_of_any_one(dataset):
    winding = attributes(dataset)["winding"]
    every = changed(dataset, orientations=[0.0, 0.5])
    refuse_unlike(every, changed(dataset, winding={**winding, "psi": 0.2}))
    with pytest.raises(UnlikeError, match=r"a sweep with winding .*, expected "):
        refuse_unlike(every, changed(dataset, winding={**winding, "pitch": 4e-3}))
    with pytest.raises(
        UnlikeError, match="a sweep of many orientations, expected one of a single orientation"
    ):
        refuse_unlike(dataset, every)


def test_a_sweep_from_before_a_material_had_a_choice_is_one_with_the_default(dataset):
    thread = asdict(Thread())
    now = changed(dataset, material={"thread": thread})
    before = changed(dataset, material={"thread": {n: v for n, v in thread.items() if n != "slack_share"}})
    refuse_unlike(now, before)
    refuse_unlike(before, now)
    yarn = changed(dataset, material={"thread": asdict(Thread(slack_share=1e-4))})
    with pytest.raises(UnlikeError, match=r"a sweep with material .*'slack_share': 1.0.*, expected .*0.0001"):
        refuse_unlike(yarn, before)
