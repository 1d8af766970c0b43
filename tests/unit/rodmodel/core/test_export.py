"""The exported folder: whole or not there, the same every time, and with the numbers of the calibration."""

import errno
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rodmodel
from rodmodel.cli import main
from rodmodel.core import law_data
from rodmodel.core.export import _folder, export
from rodmodel.io import Found, find
from tests.unit.rodmodel import calibrations

SOURCES = Path(rodmodel.__file__).parent / "core" / "src"


def saved(folder: Path, **changes: object) -> Path:
    """File of a synthetic calibration, with other provenance where that is given."""
    calibration = calibrations.calibration()
    fields = {name: getattr(calibration, name) for name in ("layout", "actuator", "law", "domain", "error")}
    path = folder / "calibration.json"
    rodmodel.save_calibration(
        rodmodel.Calibration(**fields, provenance=changes.get("provenance", calibration.provenance)), path
    )
    return path


@pytest.fixture
def found(tmp_path: Path) -> Found:
    return find("double-helix", 0.0, 3e-3, saved(tmp_path))


def contents(folder: Path) -> dict[str, str]:
    return {file.name: file.read_text() for file in folder.iterdir()}


def array(text: str, name: str) -> np.ndarray:
    (body,) = re.findall(rf"static const rm_real {name}\[\] = \{{(.*?)\}};", text, re.DOTALL)
    return np.array([float(number) for number in re.findall(r"N\((.*?)\)", body)])


def test_it_holds_the_core_the_rod_and_what_calls_it(found: Found, tmp_path: Path):
    export(found, tmp_path / "rod")
    files = contents(tmp_path / "rod")
    sources = {file.name: file for file in SOURCES.rglob("*.[ch]")}
    core = sources.keys() - {"dispatch.c", "dispatch.h"}
    others = {"law.h", "law.c", "main.c", "rodmodel.hpp", "rodmodel_mex.c", "CMakeLists.txt", "README.md"}
    assert set(files) == core | others
    for name in core:
        assert files[name] == sources[name].read_text()
    assert "double-helix, ψ 0°, pitch 3 mm" in files["README.md"]
    assert not any("@" in text for text in files.values())


def test_doubles_come_back_as_they_were(tmp_path: Path):
    of_shipped = find("double-helix", math.radians(12.0) + 2.0 * math.pi / 3.0, 3e-3)
    export(of_shipped, tmp_path / "rod")
    text = (tmp_path / "rod" / "law.c").read_text()
    data = law_data(of_shipped.calibration.law, of_shipped.turns, of_shipped.mirrored, of_shipped.psi)
    for name in ("mixing", "weights", "directions", "feature_biases", "guess"):
        np.testing.assert_array_equal(array(text, name), data.arrays[name].ravel())
    pressures = ", ".join(f"N({p:.1f})" for p in of_shipped.domain.pressure_max)
    assert f".pressure_max = {{{pressures}}}" in text


@pytest.mark.parametrize(
    ("changes", "numbers"),
    [({}, ("0.0", "0.0")), ({"beside_share": 0.5, "beside_max": 79e3}, ("0.5", "79000.0"))],
)
def test_a_limit_beside_is_exported_and_none_is_zero(
    found: Found, tmp_path: Path, changes: dict[str, float], numbers: tuple[str, str]
):
    export(replace(found, domain=replace(found.domain, **changes)), tmp_path / "rod")
    text = (tmp_path / "rod" / "law.c").read_text()
    assert re.findall(r"\.beside_\w+ = N\((.*?)\)", text) == list(numbers)


def test_snapped_branches_are_exported_with_their_own_domains(tmp_path: Path):
    file = tmp_path / "snapped.json"
    rodmodel.save_calibration(calibrations.with_snapped((2, 1), (2, -1)), file)
    export(find("double-helix", 0.0, 3e-3, file), tmp_path / "rod")
    header, text = ((tmp_path / "rod" / name).read_text() for name in ("law.h", "law.c"))
    assert "#define ROD_BRANCHES 5\nextern const rm_branches branches;" in header
    # The section is its mirror image, in which chamber 3 is chamber 2.
    names = ["snapped_2_larger", "snapped_3_smaller", "snapped_2_smaller", "snapped_3_larger"]
    assert f"branch_rods[] = {{&rod, {', '.join(f'&{name}' for name in names)}}};" in text
    assert "branch_chambers[] = {0, 2, 3, 2, 3};" in text
    assert "branch_sides[] = {0, 1, -1, -1, 1};" in text
    ends = re.findall(r"\.pressure_min = \{(.*?)\}", text)
    assert ends == [
        "N(0.0), N(0.0), N(0.0)",
        *2 * ["N(0.0), N(40000.0), N(0.0)", "N(0.0), N(0.0), N(40000.0)"],
    ]


def test_without_snapped_branches_there_is_one_rod(found: Found, tmp_path: Path):
    export(found, tmp_path / "rod")
    assert "ROD_BRANCHES" not in (tmp_path / "rod" / "law.h").read_text()
    assert "rm_branches" not in (tmp_path / "rod" / "law.c").read_text()


def test_the_same_calibration_gives_the_same_files(found: Found, tmp_path: Path):
    export(found, tmp_path / "one")
    (tmp_path / "two").mkdir()
    export(found, tmp_path / "two")
    assert contents(tmp_path / "one") == contents(tmp_path / "two")


def test_single_precision_is_said_in_the_header_alone(found: Found, tmp_path: Path):
    export(found, tmp_path / "double")
    export(found, tmp_path / "single", single_precision=True)
    double, single = contents(tmp_path / "double"), contents(tmp_path / "single")
    different = {name for name in double if double[name] != single[name]}
    assert different == {"rodmodel_core.h"}
    assert "\n#define RM_REAL_FLOAT\n" in single["rodmodel_core.h"]


def test_provenance_neither_ends_nor_begins_a_comment(tmp_path: Path):
    provenance = {"com*/ment": "*/ int x; /* ??/ \\ \n ψ", "nested": {"a": ["*/"]}}
    export(find("double-helix", 0.0, 3e-3, saved(tmp_path, provenance=provenance)), tmp_path / "rod")
    header = (tmp_path / "rod" / "law.h").read_text()
    assert header.isascii()
    assert "int x;" in header
    comment, end, rest = header.partition("*/")
    assert end
    assert rest.startswith("\n#ifndef LAW_H\n")
    assert "/*" not in comment[2:]
    assert "??" not in comment


def test_a_folder_that_holds_something_is_left_alone(found: Found, tmp_path: Path):
    place = tmp_path / "mine"
    place.mkdir()
    (place / "notes.txt").write_text("mine")
    with pytest.raises(OSError, match="mine") as caught:
        export(found, place)
    assert caught.value.errno == errno.ENOTEMPTY
    assert contents(place) == {"notes.txt": "mine"}


@pytest.mark.parametrize("there", [False, True])
def test_where_writing_fails_nothing_is_left(
    found: Found, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, there: bool
):
    place = tmp_path / "out" / "rod"
    (place if there else place.parent).mkdir(parents=True)
    write, written = Path.write_text, []

    def fail_at_last(file: Path, *given: object, **named: object) -> int:
        written.append(file)
        if len(written) == 5:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, *given, **named)

    monkeypatch.setattr(Path, "write_text", fail_at_last)
    with pytest.raises(OSError, match="No space left"):
        export(found, place)
    assert list(place.parent.iterdir()) == ([place] if there else [])
    assert not there or not any(place.iterdir())


def test_where_a_file_cannot_take_its_place_those_before_it_go(
    found: Found, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    place = tmp_path / "rod"
    place.mkdir()
    rename, moved = Path.rename, []

    def fail_at_third(file: Path, target: Path) -> Path:
        moved.append(file)
        if len(moved) == 3:
            raise PermissionError(errno.EACCES, "Permission denied")
        return rename(file, target)

    monkeypatch.setattr(_folder.Path, "rename", fail_at_third)
    with pytest.raises(PermissionError):
        export(found, place)
    assert not any(place.iterdir())


def test_the_command_writes_it_and_says_in_one_line_why_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    place = tmp_path / "controller"
    line = ["export", "--psi-deg", "20", "--out", str(place), "--float"]
    assert main(line) == 0
    assert "extern const rm_oriented rods;" in (place / "law.h").read_text()
    assert main(line) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"rodmodel: --out: got '{place}' (Directory not empty), expected")
    assert main(["export", "--out", str(tmp_path / "no" / "such")]) == 2
    assert "No such file or directory" in capsys.readouterr().err
