"""The dataset: labelled, with units, the same after a round trip, refused where something is missing."""

import numpy as np
import pytest

from calibration.dataset import (
    VARIABLES,
    DatasetError,
    attributes,
    build_dataset,
    load_dataset,
    save_dataset,
)
from calibration.design import design_paths
from calibration.path_file import PathRecord


def test_every_variable_has_a_unit_and_a_meaning(dataset):
    for name, *_ in VARIABLES:
        assert dataset[name].attrs["units"], name
        assert dataset[name].attrs["long_name"], name


def test_the_states_obey_what_the_labels_say(dataset):
    assert set(np.unique(dataset["role"])) == {"train", "held-out"}
    assert dataset["hessian"].dims == ("state", "row", "column")
    # A section bends away from a chamber that inflates: chamber 1 pushes u2 down, ∂²Π/∂u2∂p1 > 0.
    cross = dataset["hessian"].sel(row="u2", column="p1")
    assert float((cross > 0).mean()) == 1.0


def test_attributes_come_back_as_they_were_given(dataset):
    run = attributes(dataset)
    assert run["mirror"] is True
    assert run["geometry"]["body_length"] == 0.06
    assert run["domain"] == {
        "pressure_max": [70e3, 50e3, 50e3],
        "pressure_sum_max": 100e3,
        "moment_max": 2e-3,
        "torque_max": None,
    }
    assert run["material"] == {"bulk_modulus": 1e8}
    assert run["failures"] == {}
    assert run["unstable"] == {}


def test_failed_paths_are_named_with_what_was_reached(dataset, tmp_path):
    path = design_paths_one()
    state = {
        name: np.zeros([3 if d in ("chamber", "axis") else 6 for d in dims]).tolist() if dims else 0
        for name, dims, *_ in VARIABLES
    }
    record = PathRecord((state,), {"failure": "stalled", "reached": {"pressure": [1e4, 0, 0]}, "attempts": 2})
    built = build_dataset([path], {path.name: record}, {})
    save_dataset(built, tmp_path / "failed.nc")
    assert attributes(load_dataset(tmp_path / "failed.nc"))["failures"] == {path.name: record.end}


def design_paths_one():
    from rodmodel import Domain

    return design_paths(Domain((70e3, 50e3, 50e3), 100e3, 2e-3), 1, seed=0)[0]


def test_a_run_without_states_is_refused():
    with pytest.raises(DatasetError, match="no finished state"):
        build_dataset([design_paths_one()], {}, {})


def test_a_file_that_is_no_dataset_is_refused_by_name(tmp_path, dataset):
    (tmp_path / "text.nc").write_text("no netCDF")
    with pytest.raises(DatasetError, match=r"text\.nc"):
        load_dataset(tmp_path / "text.nc")
    save_dataset(dataset.drop_vars("hessian"), tmp_path / "less.nc")
    with pytest.raises(DatasetError, match="lacks hessian"):
        load_dataset(tmp_path / "less.nc")
