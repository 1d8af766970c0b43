"""The core is a solid bar; what is none, and other units, are refused."""

import math

import pytest

from fem_reference.geometry import THREADS, Core, Thread


def test_its_bending_stiffness_is_that_of_a_round_bar():
    # E π d⁴/64.
    assert Core(2e9).bending_stiffness(3e-3) == pytest.approx(2e9 * math.pi * 3e-3**4 / 64.0)


@pytest.mark.parametrize("modulus", [0.0, -5e6, math.nan, math.inf])
def test_a_modulus_that_is_none_is_refused(modulus):
    with pytest.raises(ValueError, match=r"^young_modulus: got .*, expected a positive finite number \[Pa\]"):
        Core(modulus)


def test_megapascals_are_refused_as_such():
    with pytest.raises(ValueError, match="is it in megapascals"):
        Core(5.0)


def test_threads_by_name_differ_in_their_moduli_alone():
    moduli = {name: thread.young_modulus for name, thread in THREADS.items()}
    # Kevlar, polyester, nylon: in the order of their stiffness, each with the default radius.
    assert moduli["kevlar"] > 2.0 * moduli["polyester"] > 4.0 * moduli["nylon"]
    assert {(thread.radius, thread.coupling, thread.bends) for thread in THREADS.values()} == {
        (Thread().radius, "circumference", False)
    }
