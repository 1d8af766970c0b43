"""Viscous relaxation of springs with known potentials: downhill to rest, or to a reason why not."""

import numpy as np
import pytest

from fem_reference.algebra.factorisation import PardisoSolver
from fem_reference.errors import NewtonError, UnstableError
from fem_reference.solver import Equilibrium, SolverOptions, solve_equilibrium
from fem_reference.solver.options import DEFAULT, ViscousRelaxationOptions
from fem_reference.solver.viscous_relaxation import relax
from tests.diagonal_problem import FOLD, Diagonal, Push, double_well, well_minimum


def relaxed(
    problem: Diagonal, load: float, start: np.ndarray, options: SolverOptions = DEFAULT
) -> Equilibrium:
    return relax(problem, PardisoSolver(), Push(np.full(len(start), load)), start, options)


def of_steps(steps: int) -> SolverOptions:
    return SolverOptions(viscous_relaxation=ViscousRelaxationOptions(steps=steps))


# Forces of 1e-9 N are left, on a spring of 2 N/mm at a well's bottom.
SETTLED = 1e-9


@pytest.mark.parametrize("load", [0.0, 0.1, -0.2])
@pytest.mark.parametrize(("away", "side"), [(0.05, 1.0), (-0.05, -1.0), (0.3, 1.0), (-0.3, -1.0)])
def test_an_unstable_state_is_left_downhill_on_its_own_side(away, side, load):
    """Under a load f the maximum lies near −f; where it is left for decides the minimum."""
    middle = float(np.median(np.roots([1.0, 0.0, -1.0, -load]).real))
    found = relaxed(double_well(), load, np.array([middle + away]))
    np.testing.assert_allclose(found.configuration, well_minimum(load, side), rtol=0, atol=SETTLED)
    assert found.excess_negative == 0
    # The last step is free of viscosity.
    assert found.residual <= 1e-9
    np.testing.assert_allclose(found.linear.data, 3.0 * found.configuration**2 - 1.0, rtol=1e-12)


def test_every_unknown_goes_its_own_way():
    start = np.array([0.05, -0.05, 0.4, -1.3])
    found = relaxed(double_well(4), 0.0, start)
    np.testing.assert_allclose(found.configuration, np.sign(start), rtol=0, atol=SETTLED)


def test_the_fold_of_a_lost_equilibrium_is_crossed():
    """Beyond 0.3849 N there is nothing left of zero to rest at."""
    load = 1.05 * FOLD
    found = relaxed(double_well(reach=0.1), load, np.array([-1.0 / np.sqrt(3.0)]))
    np.testing.assert_allclose(found.configuration, well_minimum(load, 1.0), rtol=0, atol=SETTLED)


def test_a_body_at_rest_stays():
    found = relaxed(double_well(), 0.0, np.array([-1.0]))
    np.testing.assert_allclose(found.configuration, -1.0, rtol=0, atol=SETTLED)


def test_a_step_in_time_is_one_of_backward_euler():
    """On a unit spring under a unit load the step from zero at the rate r ends at 1/(1 + r)."""
    spring, target = Diagonal(lambda x: x, np.ones_like, 1, reach=1.0), Push(np.ones(1))
    for rate in (0.25, 1.0, 4.0):
        resistance = spring.viscous(np.zeros(1), rate)
        found = solve_equilibrium(spring, PardisoSolver(), target, np.zeros(1), viscous=resistance)
        np.testing.assert_allclose(found.configuration, 1.0 / (1.0 + rate), rtol=1e-14)


def test_a_step_in_time_must_have_a_positive_stiffness():
    """At 0.1 mm from the middle of the double well the stiffness is −0.97 N/mm."""
    well, start, unloaded = double_well(), np.array([0.1]), Push(np.zeros(1))
    with pytest.raises(UnstableError):
        solve_equilibrium(well, PardisoSolver(), unloaded, start, viscous=well.viscous(start, 0.96))
    slow = solve_equilibrium(well, PardisoSolver(), unloaded, start, viscous=well.viscous(start, 2.0))
    assert 0.1 < slow.configuration[0] < 0.3


def test_a_step_in_time_may_not_be_longer_than_the_reach():
    spring, target = Diagonal(lambda x: x, np.ones_like, 1, reach=0.25), Push(np.ones(1))
    resistance = spring.viscous(np.zeros(1), 1.0)
    with pytest.raises(NewtonError, match=r"^the step in time would be one of 5\.0e-01 mm"):
        solve_equilibrium(spring, PardisoSolver(), target, np.zeros(1), viscous=resistance)


class Blocked(Diagonal):
    """A unit spring; what is in the way leaves these shares of its trial steps in turn, then nothing is."""

    def __init__(self, *shares):
        super().__init__(lambda x: x, np.ones_like, 1, reach=1.0)
        self.shares = list(shares)

    def allowed(self, linear, trial):
        return self.shares.pop(0) if self.shares else 1.0


def test_a_step_in_time_does_not_end_with_something_in_the_way():
    """A tenth of the way is left behind the second cut, small beside the first step as it is."""
    spring, target, start = Blocked(0.8, 1.0, 0.5), Push(np.ones(1)), np.zeros(1)
    resistance = spring.viscous(start, 1.0)
    found = solve_equilibrium(spring, PardisoSolver(), target, start, viscous=resistance)
    np.testing.assert_allclose(found.configuration, 0.5, rtol=1e-14)


def test_a_step_in_time_does_not_end_under_a_large_force():
    """One of a hundred springs hardens: 0.8 N are left to it, with a step that is small beside the first."""
    hard = np.array([1.0, *np.zeros(99)])
    spring = Diagonal(
        lambda x: x + hard * (49.0 * x + 1e5 * x**3),
        lambda x: 1.0 + hard * (49.0 + 3e5 * x**2),
        100,
        reach=1.0,
    )
    target, start = Push(np.ones(100)), np.zeros(100)
    found = solve_equilibrium(spring, PardisoSolver(), target, start, viscous=spring.viscous(start, 1.0))
    assert found.iterations > 2
    assert found.residual <= 0.05


def test_without_a_minimum_there_is_no_rest():
    """A constant force, on nothing: every step goes on, and without viscosity the matrix is singular."""
    free = Diagonal(np.zeros_like, np.zeros_like, 1, reach=1.0)
    with pytest.raises(NewtonError, match=r"does not come to rest in 20 steps; the last failure: \w+"):
        relaxed(free, 0.1, np.zeros(1), of_steps(20))


def test_steps_that_fail_at_any_length_are_given_up():
    """The energy −5·10⁵ x² N/mm falls faster than viscosity is added, of 10³ N/mm at most."""
    blown = Diagonal(lambda x: -1e6 * x, lambda x: np.full_like(x, -1e6), 1, reach=1.0)
    with pytest.raises(NewtonError, match=r"in \d steps; .* negative eigenvalues more than") as caught:
        relaxed(blown, 0.0, np.ones(1))
    assert not isinstance(caught.value, UnstableError)


class Fragile(Diagonal):
    """A constant force on nothing, and steps in time that fail where they are longer than 0.2 mm."""

    def __init__(self):
        super().__init__(np.zeros_like, np.zeros_like, 1, reach=10.0)
        self.lengths = []

    def viscous(self, at, rate):
        resistance = super().viscous(at, rate)
        self.lengths.append(0.05 / resistance.rate)
        return resistance

    def update_forces(self, linear, at, target, viscous=None):
        if viscous is not None and abs(at - viscous.origin).max() > 0.2:
            raise NewtonError("too far")
        return super().update_forces(linear, at, target, viscous)


def test_a_length_that_failed_is_not_tried_again_with_every_other_step():
    fragile = Fragile()
    with pytest.raises(NewtonError, match="too far"):
        relaxed(fragile, 0.05, np.zeros(1), of_steps(30))
    failed = [length > 0.2 for length in fragile.lengths]
    # Twice as long a step after every one that is taken, a third after one that failed: 10 of 30 would fail.
    assert 0 < sum(failed) <= 5


class Undecided(Diagonal):
    """A spring at whose rest no step without viscosity converges, as with a node on an edge of a wall."""

    def __init__(self):
        super().__init__(lambda x: 2.0 * x, lambda x: np.full_like(x, 2.0), 1, reach=1.0)
        self.last_steps = []

    def update_forces(self, linear, at, target, viscous=None):
        if viscous is None:
            self.last_steps.append(float(at[0]))
            raise NewtonError("on an edge")
        return super().update_forces(linear, at, target, viscous)


def test_a_body_that_has_not_moved_is_not_tried_again_and_again():
    spring = Undecided()
    with pytest.raises(NewtonError, match="on an edge"):
        relaxed(spring, 0.5, np.zeros(1))
    own = DEFAULT.viscous_relaxation
    # A few of 80 steps: the first from farther away, and then from within the distance that is told apart.
    assert own.last_steps <= len(spring.last_steps) <= own.last_steps + 1
    assert np.ptp(spring.last_steps[-own.last_steps :]) < own.still
