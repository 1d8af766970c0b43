"""Newton's method on problems of a few unknowns: line search, branches, kept stiffness, reach and failure."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.algebra.factorisation import PardisoSolver
from fem_reference.errors import NewtonError, UnstableError
from fem_reference.solver import Contact, Equilibrium, SolverOptions, solve_equilibrium
from fem_reference.solver.modified_newton import modified_newton_steps
from fem_reference.solver.options import NewtonOptions
from tests.diagonal_problem import Counted, Diagonal, Push, double_well, tolerate

# Iterations that the method has.
MOST = SolverOptions().newton.iterations


def solve(problem: Diagonal, load: float, start: float, inertia: int = 0, **arguments) -> Equilibrium:
    unknowns = problem.pattern.size
    target = Push(np.full(unknowns, load))
    return solve_equilibrium(problem, PardisoSolver(), target, np.full(unknowns, start), inertia, **arguments)


def test_steps_that_grow_are_halved():
    """Plain Newton on arctan diverges from beyond 1.39: its steps grow from the first to the second."""
    problem = Diagonal(np.arctan, lambda x: 1.0 / (1.0 + x**2), 3, reach=20.0)
    found = solve(problem, 0.0, 2.0)
    np.testing.assert_allclose(found.configuration, 0.0, atol=1e-9)
    assert found.excess_negative == 0


@pytest.mark.parametrize("start", [0.5, -0.5])
def test_an_indefinite_matrix_is_damped_and_left_downhill(start):
    """Newton's own step from −0.25 N/mm would go to the double well's middle, the maximum."""
    found = solve(double_well(2), 0.0, start)
    np.testing.assert_allclose(found.configuration, np.sign(start), atol=1e-9)
    assert found.excess_negative == 0


@pytest.mark.parametrize("start", [0.01, -0.02])
def test_a_matrix_that_stays_indefinite_is_refused(start):
    """From so near the maximum a few damped steps do not lead away."""
    with pytest.raises(UnstableError, match="2 negative eigenvalues more than the branch"):
        solve(double_well(2), 0.0, start)


def test_a_matrix_that_no_viscosity_makes_definite_is_refused():
    steep = Diagonal(lambda x: -1e3 * x, lambda x: np.full_like(x, -1e3), 1, reach=1.0)
    with pytest.raises(UnstableError, match="1 negative eigenvalues more than the branch"):
        solve(steep, 0.0, 0.1)
    assert steep.longest_step == 0.0


class RoundCore(Contact):
    def core_curvature_stiffness(self, linear):
        return np.full_like(linear.data, -2.0)


class Rounded(Diagonal):
    """A double well whose contact, taken as convex, makes its matrix definite everywhere."""

    tolerances = replace(Diagonal.tolerances, modified_newton_step=0.1)
    contact = RoundCore()

    def __init__(self, depths=(1.0, 1.0)):
        k = np.array(depths)
        super().__init__(lambda x: x**3 - k * x, lambda x: 3.0 * x**2 - k, len(k), reach=0.5)


def test_steps_with_convex_contact_lead_to_a_minimum_and_are_given_up_at_a_saddle():
    """Near the maximum such a step doubles the distance from it; mixed ones go there, and tell so."""
    np.testing.assert_allclose(solve(Rounded(), 0.0, 0.2).configuration, 1.0, atol=1e-9)
    with pytest.raises(UnstableError):
        solve(Rounded((1.0, 0.6, 0.3)), 0.0, 0.01)


def test_steps_with_convex_contact_that_grow_are_given_up():
    """Where mixed steps are not taken, as nothing is near enough."""
    problem = Rounded()
    tolerate(problem, modified_newton_step=0.0)
    with pytest.raises(UnstableError):
        solve(problem, 0.0, 1e-3)
    assert problem.stiffnesses <= MOST


class Rough(Rounded):
    """The same with contact's noise in the force, which no stiffness knows of."""

    tolerances = replace(Rounded.tolerances, contact_noise=1e-3)

    def update_forces(self, linear, at, target, viscous=None):
        linear = super().update_forces(linear, at, target, viscous)
        return replace(linear, residual=linear.residual + 3e-4 * np.sin(1e7 * at), walls_touch=True)


@pytest.mark.parametrize("start", [0.12, 0.14, 0.2])
def test_mixed_steps_that_end_in_noise_do_not_tell_the_stiffness(start):
    """Their differences are the noise's; the stiffness where they end does, 2 N/mm in the minimum."""
    found = solve(Rough((1.0, 0.6, 0.3)), 0.0, start)
    # The noise of 3e-4 N over the softest spring, 0.6 N/mm in its minimum.
    np.testing.assert_allclose(found.configuration, np.sqrt([1.0, 0.6, 0.3]), rtol=0, atol=2 * 5e-4)
    assert found.excess_negative == 0


class SlidingOff(Contact):
    def convexified(self, linear):
        return np.where(linear.data < 0.0, 2.0, linear.data)


class Opening(Diagonal):
    """Two springs, of 1 and of 0.05 N/mm, the first with a negative pivot unless contact is convex.

    The second has a wall in its way that it leaves by 0.01 mm, and which is the stiffer the farther inside.
    """

    tolerances = replace(
        Diagonal.tolerances, contact_noise=1e-3, modified_newton_step=0.1, exact_stiffness=False
    )
    contact = SlidingOff()
    spring, left, wall = 0.05, 0.01, 50.0

    def __init__(self):
        super().__init__(self.force, self.stiffness, 2, reach=0.5)

    def force(self, x):
        opened = self.spring * (x[1] - self.left) - self.wall * min(x[1], 0.0) ** 2
        return np.array([x[0] - 1.0, opened])

    def stiffness(self, x):
        return np.array([-0.5, self.spring - 2.0 * self.wall * min(x[1], 0.0)])

    def update_forces(self, linear, at, target, viscous=None):
        linear = super().update_forces(linear, at, target, viscous)
        return replace(linear, residual=linear.residual + 1e-5 * np.sin(1e7 * at), walls_touch=True)


@pytest.mark.parametrize("start", [-0.1, -0.2])
def test_mixed_steps_that_end_in_noise_are_not_the_end(start):
    """With factors from inside the wall 4e-4 N lead on by less than 1e-4 mm, and not by 0.008."""
    target, at = Push(np.zeros(2)), np.array([0.9, start])
    found = solve_equilibrium(Opening(), PardisoSolver(), target, at)
    # The noise of 1e-5 N over 0.05 N/mm, and what of a step is noise.
    np.testing.assert_allclose(
        found.configuration, [1.0, Opening.left], rtol=0, atol=2e-4 + Opening.tolerances.contact_noise
    )
    assert found.excess_negative == 0


class Rattling(Opening):
    """The same without walls in contact, with round-off in its forces as a large mesh has."""

    roundoff = 1e-10

    def force(self, x):
        return super().force(x) + self.roundoff * np.sin(1e12 * x)

    def update_forces(self, linear, at, target, viscous=None):
        return Diagonal.update_forces(self, linear, at, target, viscous)


def test_with_convex_contact_steps_of_round_off_are_the_end():
    """The branch's own stiffness, which would tell, is not looked at; steps of 2e-9 mm go on for ever."""
    target, at = Push(np.zeros(2)), np.array([0.9, -0.1])
    found = solve_equilibrium(Rattling(), PardisoSolver(), target, at)
    # Force below 1e-7 N over 0.05 N/mm.
    np.testing.assert_allclose(found.configuration, [1.0, Rattling.left], rtol=0, atol=2e-6)
    # None of the rod's roundness had to be left out.
    assert found.convex == 0.0


def test_where_contact_was_convex_it_may_be_so_from_the_start():
    """Left of 1/√3 the double well's own matrix is indefinite: it is not looked at then."""
    least = {}
    for convex in (None, 1.0):
        solver = Counted()
        found = solve_equilibrium(
            Rounded(), solver, Push(np.zeros(2)), np.full(2, 0.2), on_the_way=True, convex=convex
        )
        # Steps with 3x² + 1 in place of 3x² − 1 halve the distance, 0.02 mm in the last.
        np.testing.assert_allclose(found.configuration, 1.0, rtol=0, atol=0.02)
        assert found.convex == 0.5
        assert found.excess_negative == 0
        least[convex] = min(solver.least)
    assert least[None] < 0.0 < least[1.0]


def test_the_longest_step_is_told():
    spring = Diagonal(lambda x: x, np.ones_like, 2, reach=2.0)
    assert solve(spring, 1.0, 0.0).longest == pytest.approx(1.0)
    assert solve(spring, 1.0, 1.0).longest == 0.0


def test_a_maximum_is_told_where_it_is_the_start():
    """There is no force, so that nothing leads away: the inertia says what it is."""
    found = solve(double_well(2), 0.0, 0.0)
    assert found.iterations == 0
    assert found.excess_negative == 2


def test_what_only_contact_without_its_roundness_holds_is_told_as_it_is():
    found = solve(Rounded(), 0.0, 0.0)
    assert (found.excess_negative, found.negative_eigenvalues_true_contact) == (0, 2)


def test_a_branch_of_saddles_is_followed_where_it_is_asked_for():
    found = solve(double_well(), 0.01, 0.1, inertia=1)
    # x³ − x = 0.01 next to zero: x = −0.01 − 10⁻⁶ + ...
    assert found.configuration[0] == pytest.approx(-0.010001, abs=1e-8)
    assert found.excess_negative == 1


def test_no_step_is_longer_than_the_reach():
    spring = Diagonal(lambda x: x, np.ones_like, 2, reach=0.25)
    found = solve(spring, 1.0, 0.0)
    np.testing.assert_allclose(found.configuration, 1.0, atol=1e-9)
    assert spring.longest_step == pytest.approx(0.25)


def test_what_does_not_converge_says_how_far_it_was():
    options = SolverOptions(newton=NewtonOptions(iterations=3))
    spring = Diagonal(lambda x: x, np.ones_like, 2, reach=0.1)
    with pytest.raises(NewtonError, match="no convergence in 3 iterations"):
        solve(spring, 1.0, 0.0, options=options)


@pytest.mark.parametrize("exact", [True, False])
def test_iterations_that_lead_nowhere_are_given_up_where_they_must_end_exactly(exact):
    """Newton's step from x on |x|^(1/5) is −5x, and half of it still leads farther away than x is."""
    root = Diagonal(lambda x: np.sign(x) * np.abs(x) ** 0.2, lambda x: 0.2 * np.abs(x) ** -0.8, 1, reach=1e9)
    tolerate(root, exact_stiffness=exact)
    with pytest.raises(NewtonError):
        solve(root, 0.0, 0.01)
    assert (root.stiffnesses < MOST) == exact


def test_a_force_that_is_not_finite_is_told():
    broken = Diagonal(lambda x: np.full_like(x, np.nan), np.ones_like, 1, reach=1.0)
    with pytest.raises(NewtonError, match="not finite at iteration 0"):
        solve(broken, 0.0, 0.0)


def hardening(nearby: float, exact: bool) -> Diagonal:
    """A spring of the force sinh x: two newtons are at arsinh 2."""
    problem = Diagonal(np.sinh, np.cosh, 2, reach=20.0)
    tolerate(problem, modified_newton_step=nearby, exact_stiffness=exact)
    return problem


@pytest.mark.parametrize("exact", [True, False])
def test_near_the_equilibrium_the_stiffness_is_kept(exact):
    plain, keeping = hardening(0.0, True), hardening(0.3, exact)
    answers = [solve(problem, 2.0, 0.0) for problem in (plain, keeping)]
    # A force of 1e-9 N is left, on a spring of √5 N/mm; or a step of 1e-6 mm, and shorter ones after it.
    for found, settled in zip(answers, (1e-9, 1e-9 if exact else 2e-6), strict=True):
        np.testing.assert_allclose(found.configuration, np.arcsinh(2.0), rtol=0, atol=settled)
        np.testing.assert_allclose(found.linear.residual, np.sinh(found.configuration) - 2.0, atol=1e-15)
    assert keeping.stiffnesses < plain.stiffnesses
    own = np.cosh(answers[1].configuration)
    if exact:
        np.testing.assert_array_equal(answers[1].linear.data, own)
    else:
        # That of the place before the kept steps, 0.3 mm away; it changes by sinh x, 2.8 N/mm² at most.
        assert 0.0 < np.abs(answers[1].linear.data - own).max() <= 2.8 * 0.3


@pytest.mark.parametrize(("second", "enough"), [(1.2, True), (1.6, False)])
def test_the_first_step_with_a_kept_stiffness_may_be_as_long_as_the_one_before(second, enough):
    """A step of 1 mm led here, this spring takes another of ``second``, and one of 0.05 mm to balance."""
    places = 1.0 + np.array([0.0, second, second + 0.05, second + 1.0])
    forces = np.array([-second, -0.05, 0.0, 0.95])
    spring = Diagonal(lambda x: np.interp(x, places, forces), np.ones_like, 1, reach=9.0)
    solver, target, at = PardisoSolver(), Push(np.zeros(1)), np.ones(1)
    linear = spring.linearise(at, target)
    solver.factorise(spring.pattern.matrix(linear.data), spring.pattern.revision)
    found, _, _, balanced = modified_newton_steps(spring, solver, target, at, linear, size=1.0)
    assert balanced == enough
    np.testing.assert_allclose(found, places[2] if enough else at, atol=1e-12)


def test_a_saddle_comes_with_its_own_stiffness_though_others_may_keep_theirs():
    """Its negative pivots are judged by the stiffness where it is."""
    well = double_well()
    tolerate(well, modified_newton_step=0.3, exact_stiffness=False)
    found = solve(well, 0.1, 0.15, inertia=1)
    assert found.excess_negative == 1
    np.testing.assert_array_equal(found.linear.data, 3.0 * found.configuration**2 - 1.0)


def test_an_equilibrium_on_the_way_ends_with_a_small_step():
    """A fifth of the size from which a stiffness is kept, 0.06 mm."""
    problem = hardening(0.3, True)
    found = solve(problem, 2.0, 0.0, on_the_way=True)
    # Newton's error after a step s is s²/2 tanh x, tanh x below 1.
    np.testing.assert_allclose(found.configuration, np.arcsinh(2.0), rtol=0, atol=0.5 * 0.06**2)
    thorough = hardening(0.3, True)
    solve(thorough, 2.0, 0.0)
    assert problem.stiffnesses < thorough.stiffnesses
    assert found.excess_negative == 0


def test_long_steps_with_another_stiffness_are_given_up():
    """Where the force falls with the way, and viscosity of any rate only leads further off."""
    sliding = Diagonal(lambda x: -x, lambda x: -np.ones_like(x), 1, reach=0.05)
    with pytest.raises(NewtonError, match=r"steps of more than 0\.05 mm"):
        solve(sliding, 1.0, 0.0)
