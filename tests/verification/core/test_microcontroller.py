"""The exported rod on an emulated Cortex-M7 gives what it gives here, and fits into its memory."""

from pathlib import Path

import pytest

from tests.verification.core import microcontroller
from tests.verification.core.expected import assert_example
from tests.verification.core.toolchain import OWN, exported, needs, table

# The processor adds in one lane, with a C library of its own: rounding differs, so does Newton's last step.
PARTS = {False: 1e-12, True: 2e-4}
# Tightly coupled memory of processors of that precision, STM32F76x and STM32F74x, and their flash.
RAM, FLASH = {False: 128 * 1024, True: 64 * 1024}, 1024 * 1024


@pytest.fixture(scope="module", params=[False, True])
def single_precision(request: pytest.FixtureRequest) -> bool:
    return request.param


@pytest.fixture(scope="module")
def folder(single_precision: bool, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The core is compiled into it once for both tests."""
    needs(*microcontroller.TOOLS)
    return exported(tmp_path_factory.mktemp("target") / "rod", single_precision=single_precision)


def test_the_example_prints_the_numbers_of_python(folder: Path, single_precision: bool):
    rows = table(microcontroller.run(folder, "example", single_precision))
    assert_example(rows, OWN, PARTS[single_precision])


def test_a_rod_fits_into_a_small_controller(folder: Path, single_precision: bool):
    found = microcontroller.footprint(folder, single_precision)
    assert found.workspace["jacobian"] + max(found.stack.values()) < RAM[single_precision]
    assert found.workspace["solve"] < found.workspace["jacobian"]
    assert found.stack["free"] < found.stack["loaded"]
    assert found.code + found.law < FLASH
