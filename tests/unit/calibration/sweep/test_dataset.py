"""The dataset: labelled, with units, the same after a round trip, refused where it is damaged."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from calibration.sweep import (
    DatasetError,
    RunPlan,
    attributes,
    build_dataset,
    design_paths,
    load_dataset,
    open_run,
    save_dataset,
)
from calibration.sweep.dataset import VARIABLES
from calibration.sweep.path_file import PathRecord
from fem_reference import Design
from rodmodel import Domain
from tests.faults import full_disk, killed_at_every_write
from tests.fem_fixtures import TINY

PLAN = RunPlan(Design(), "coarse", Domain((70e3, 50e3, 50e3), 100e3, 2e-3), 1, seed=0, end_compliance=0.23e-3)


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
    } | {"attempt": 2}
    record = PathRecord((state,), {"failure": "stalled", "reached": {"pressure": [1e4, 0, 0]}, "attempts": 2})
    built = build_dataset([path], {path.name: record}, open_run(tmp_path, PLAN, "run", {}))
    save_dataset(built, tmp_path / "failed.nc")
    assert attributes(load_dataset(tmp_path / "failed.nc"))["failures"] == {path.name: record.end}


def design_paths_one():
    from rodmodel import Domain

    return design_paths(Domain((70e3, 50e3, 50e3), 100e3, 2e-3), 1, seed=0, pressure_step=3e3)[0]


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


def test_a_mesh_of_ones_own_is_told_by_its_counts(dataset, tmp_path):
    run = open_run(tmp_path, replace(PLAN, level=TINY), "run", {})
    built = dataset.assign_attrs(mesh=json.dumps(run["mesh"]))
    save_dataset(built, tmp_path / "own.nc")
    mesh = attributes(load_dataset(tmp_path / "own.nc"))["mesh"]
    assert mesh["outer_arc"] == TINY.outer_arc
    assert mesh == run["mesh"]


def number(name, value, where=0):
    def damage(dataset):
        values = dataset[name].values.astype(float)
        values[where] = value
        return dataset.assign({name: (dataset[name].dims, values)})

    return damage


def attribute(name, value):
    return lambda dataset: dataset.assign_attrs({name: value})


def within(name, key, value):
    return lambda dataset: dataset.assign_attrs(
        {name: json.dumps({**json.loads(dataset.attrs[name]), key: value})}
    )


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda dataset: dataset.assign_attrs().drop_attrs(), "attributes: layout: got nothing"),
        (lambda dataset: dataset.isel(state=slice(0)), "got no states"),
        (lambda dataset: dataset.isel(chamber=slice(2)), "pressure: got float64 of ("),
        (number("energy", np.nan, slice(None)), "energy: got nan in state 0, expected numbers from"),
        (number("curvature", np.inf, 3), "curvature: got inf in state 3"),
        (number("pressure", -1.0, 5), "pressure: got -1 in state 5, expected numbers from 0 to 1e+08 Pa"),
        (number("stable", 2), "stable: got 2 in state 0"),
        (number("psi", np.inf), "psi: got numbers beyond"),
        (
            lambda dataset: dataset.assign(role=("state", ["judge"] * dataset.sizes["state"])),
            "role: got 'judge'",
        ),
        (attribute("geometry", "{broken"), "geometry: got '{broken'"),
        (attribute("failures", "[" * 100_000), "failures: got '[["),
        (attribute("domain", "[1, 2]"), "domain: got [1, 2], expected a JSON object"),
        (attribute("material", "text"), "material: got 'text', expected a JSON object"),
        (attribute("layout", "spiral"), "layout: got 'spiral', expected one of"),
        (attribute("mesh", "absent"), "mesh: elements: got 'absent'"),
        (attribute("mesh", '{"inner_arc": 0}'), "mesh: inner_arc: got 0, expected a whole number from 1"),
        (attribute("winding", "{}"), "winding: got no pitch, psi"),
        (attribute("seed", "0"), "seed: got '0', expected a whole number"),
        (attribute("mirror", "1"), "mirror: got '1', expected one of false, true"),
        (within("geometry", "body_length", -1.0), "geometry.body_length: got -1.0, expected a number from 0"),
        (within("geometry", "colour", 1.0), "colour"),
        (within("geometry", "outer_wall", 5e-3), "wall"),
        (
            within("domain", "pressure_max", [1.0, 2.0]),
            "domain.pressure_max: got [1.0, 2.0], expected 3 numbers",
        ),
        (within("domain", "moment_max", float("nan")), "domain.moment_max: got nan"),
    ],
)
def test_a_damaged_dataset_is_refused_in_one_line_by_its_name(dataset, tmp_path, damage, told):
    file = tmp_path / "damaged.nc"
    save_dataset(damage(dataset), file)
    with pytest.raises(DatasetError, match=rf"^dataset: .*damaged\.nc: .*{re.escape(told)}") as caught:
        load_dataset(file)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_cut_short_is_refused_by_its_name(dataset, tmp_path):
    file = tmp_path / "cut.nc"
    save_dataset(dataset, file)
    file.write_bytes(file.read_bytes()[:-2000])
    with pytest.raises(DatasetError, match=r"^dataset: cannot read .*cut\.nc as netCDF") as caught:
        load_dataset(file)
    assert "\n" not in str(caught.value)


def test_a_full_disk_leaves_the_old_dataset(dataset, tmp_path):
    file = tmp_path / "dataset.nc"
    save_dataset(dataset, file)
    before = file.read_bytes()
    with full_disk(len(before) // 2), pytest.raises((OSError, RuntimeError)):
        save_dataset(dataset, file)
    assert file.read_bytes() == before
    assert list(tmp_path.iterdir()) == [file]


def test_a_kill_between_any_two_writes_leaves_a_whole_dataset(dataset, tmp_path, monkeypatch):
    file, whole = tmp_path / "dataset.nc", dataset.isel(state=slice(3))
    save_dataset(whole, file)
    fewer = whole.isel(state=slice(2))
    found = []

    def after(attempt):
        found.append(load_dataset(file))
        save_dataset(whole, file)

    kills = killed_at_every_write(monkeypatch, lambda attempt: save_dataset(fewer, file), after)
    assert kills >= 4
    for held in found[:-2]:
        xr.testing.assert_identical(held, whole)
    for held in found[-2:]:
        xr.testing.assert_identical(held, fewer)
