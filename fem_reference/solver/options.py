"""Options of the solvers: every number that steers them, with what it does and why.

A step's size is the root-mean-square displacement of the nodes [mm], a force that of one node [N], in the
body's units, so that they hold for bodies of every size. A convexified matrix is the stiffness with contact
made convex, which has no negative eigenvalues of its own
(`InertiaCorrection`). Where a problem is exact, an equilibrium must come with its own stiffness
(`Problem.exact`).
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class ConvergenceOptions:
    """When an iterate is an equilibrium."""

    #: Largest residual force [N]: pressures put 1e-3 to 1e-2 N on a node, round-off 1e-11 N.
    force: float = 1e-9
    #: Largest residual moment [N mm].
    moment: float = 1e-8
    #: Residual force of contact's noise [N]: the barrier's gradient jumps where contact pairs change kind.
    noise_force: float = 1e-3
    #: Residual moment of contact's noise [N mm].
    noise_moment: float = 1e-4
    #: Iterations before contact's noise may end the method, as the first steps are not yet about a jump.
    noise_after: int = 3
    #: Step that is round-off of a large mesh [mm].
    round_off_step: float = 1e-12
    #: Residual force that is round-off of a large mesh [N].
    round_off_force: float = 1e-7
    #: Step that ends the method with a convexified matrix [mm], which may be a hundred times too stiff.
    convex_step: float = 1e-8
    #: Residual force that ends the method with a convexified matrix [N].
    convex_force: float = 1e-7
    #: Step that ends a rough equilibrium on the way to another, as a share of
    #: `Tolerances.modified_newton_step`.
    rough_step: float = 0.2
    #: Expected next step that ends one, as a share of the same; not where the problem needs the exact
    #: stiffness.
    rough_next_step: float = 0.04
    #: Residual force that ends a rough equilibrium with a convexified matrix or a step in time [N].
    rough_force: float = 5e-2


@dataclass(frozen=True)
class LineSearchOptions:
    """How much of a step is taken."""

    #: Factor by which a step may exceed the one before it, or that one is halved (monotonicity test).
    growth: float = 2.0
    #: Share of `Tolerances.max_step` below which steps may grow: short ones do not lead astray.
    growth_floor: float = 0.1
    #: Times that one step is halved.
    halvings: int = 2
    #: Cuts of a step before what blocks it is an error.
    cuts: int = 12


@dataclass(frozen=True)
class NewtonOptions:
    """Newton's method."""

    #: Iterations of an equilibrium.
    iterations: int = 50
    #: Iterations of a step in time: one that needs more is too long.
    time_step_iterations: int = 8
    #: Residual force above which the inertia must be the branch's [N]: below, no step leaves the branch.
    inertia_force: float = 1e-4
    #: Iterations in a row that leave more force than the best, where exact: a shorter load step costs less.
    stagnant_iterations: int = 6
    #: Steps beyond `Tolerances.max_step` with a corrected matrix that end the method: it has left the branch.
    long_steps: int = 3
    #: Step below which Anderson acceleration takes over from new convexified matrices, as a share of
    #: `Tolerances.modified_newton_step`.
    anderson_step: float = 0.4


@dataclass(frozen=True)
class EndOfSteps:
    """Step with old factors that ends the iteration, and what it may leave.

    Parameters
    ----------
    step, force, moment : size of the step [mm], residual force [N] and moment [N mm].
    """

    step: float
    force: float
    moment: float


@dataclass(frozen=True)
class ModifiedNewtonOptions:
    """Modified Newton steps, which keep the branch's own factors."""

    #: Steps with the same factors; 0 for none.
    steps: int = 8
    #: Share of the last step but one that a step may be, or new factors are due: steps shrink in pairs.
    contraction: float = 0.2
    #: Factor by which a step may exceed the last, as the first is often as long as the step before it.
    growth: float = 1.5
    #: End where nothing follows: strains of 1e-6, and 1e-8 of the actuator's length at its tip.
    end: EndOfSteps = EndOfSteps(1e-6, 1e-5, 1e-8)
    #: End where the exact stiffness follows and judges.
    exact_end: EndOfSteps = EndOfSteps(1e-8, 1e-6, 1e-8)


@dataclass(frozen=True)
class AndersonOptions:
    """Anderson acceleration of steps that keep a convexified matrix."""

    #: Steps with the same factors; 0 for none.
    steps: int = 40
    #: States that are combined.
    depth: int = 8
    #: Length of a combined step over that of the plain one, beyond which the oldest states are left out.
    farthest: float = 30.0
    #: Relative singular value below which a direction of steps is lost in their noise.
    noise: float = 1e-6
    #: Share of the best step below which a step counts as shorter.
    progress: float = 0.9
    #: Steps in a row without progress that end the acceleration.
    stagnant_steps: int = 6
    #: Steps in a row without progress that end it in contact's noise, or on the way to another equilibrium.
    stagnant_steps_in_noise: int = 2
    #: Length of a step over the best one that calls for a restart from the best, as the states were too far.
    restart_growth: float = 3.0
    #: Restarts.
    restarts: int = 2
    #: End where the exact stiffness follows: less far than modified Newton steps, in contact's noise.
    exact_end: EndOfSteps = EndOfSteps(1e-5, 1e-4, 1e-5)


@dataclass(frozen=True)
class InertiaCorrectionOptions:
    """Matrices with the inertia of the branch where the stiffness has another."""

    #: Corrected matrices with which the method gives up: steps away from a saddle grow and shrink over 20.
    steps: int = 40
    #: The same where the problem is exact: so long a way may end on another branch.
    exact_steps: int = 8
    #: Shares of the rod's curvature stiffness left out in turn: without all of it steps are far too short.
    core_shares: tuple[float, ...] = (0.0, 0.25, 0.5, 1.0)
    #: Negative pivots above which the last share is tried next, as none between served.
    many_negative: int = 8
    #: Negative pivots that the first matrix may keep: an extrapolated start lacks single elements' pressures.
    first_negative: int = 20
    #: Matrices of one equilibrium that may have viscosity added.
    viscous_steps: int = 6
    #: Rates of viscosity in turn, in the silicone's stiffness at rest, for one negative pivot too many.
    rates: tuple[float, ...] = (0.2, 0.8, 3.2, 12.8)
    #: Rates for two: one of 26 such matrices wanted the second.
    rates_of_two: tuple[float, ...] = (0.2, 3.2, 12.8)
    #: Rates for more: all of 30 such matrices wanted the last.
    rates_of_more: tuple[float, ...] = (0.2, 12.8)


@dataclass(frozen=True)
class StepLengtheningOptions:
    """Longer steps where steps with a corrected matrix are each a multiple of the one before."""

    #: Cosine between two steps that are alike.
    alike: float = 0.95
    #: Least ratio of two steps that are alike; faster ones need no help.
    least_ratio: float = 0.7
    #: Greatest ratio of two steps that are alike.
    greatest_ratio: float = 1.6
    #: Alike steps in a row before one is lengthened.
    row: int = 2
    #: Factor of the first lengthening, and twice as much after each that proves right; 1 for none.
    most: float = 8.0
    #: Displacement of a node that a lengthened step may reach [mm].
    longest: float = 1.0


@dataclass(frozen=True)
class ContinuationOptions:
    """Steps of load along a path; lengths are in the measure of the target's ``to``, about 1 kPa."""

    #: Iterations up to which a load step is easy and the next one grows.
    easy_iterations: int = 4
    #: Iterations beyond which the next load step shrinks.
    hard_iterations: int = 8
    #: Factor of a load step that was easy.
    growth: float = 1.6
    #: Factor of a load step that was hard.
    shrinkage: float = 0.6
    #: Longest load step after one that failed, as a share of that one: the next would fail again.
    after_failure: float = 0.7
    #: Factor by which that longest step grows with every easy one.
    recovery: float = 1.1
    #: Shortest load step.
    shortest: float = 0.05
    #: Halvings of a failed load step before viscous relaxation is tried.
    halvings: int = 2
    #: Cosine between two legs of a path up to which the second goes straight on.
    straight: float = 0.999
    #: Earlier states of an extrapolation: 2 for a parabola, 1 for a line, 0 for the tangent.
    earlier_states: int = 2
    #: Largest sum of absolute weights of a parabola, as it multiplies the states' errors.
    amplification: float = 8.0
    #: The same where `Problem.stride` chooses load steps, which may then be half as long again as the last.
    amplification_by_stride: float = 13.0
    #: Cuts of a tangent start before the present state is the start.
    predictor_cuts: int = 6
    #: Displacement of a node up to which a body that loses its balance slides and does not jump [mm].
    slide: float = 0.1
    #: Share of that slide by which the load itself may move a body over a step that tells a loss of balance.
    own_motion: float = 0.5
    #: Rest of a leg at which a path that is to end at an instability ends where its goal fails.
    missed_share: float = 0.05


@dataclass(frozen=True)
class ViscousRelaxationOptions:
    """Steps in time of a viscous body; a rate is the relaxation time over the time step."""

    #: Rate of the first step.
    first_rate: float = 0.5
    #: Factor by which the rate falls after an easy step.
    faster: float = 2.0
    #: Factor by which the rate rises after a failed step.
    slower: float = 3.0
    #: Rate below which the next step is to equilibrium itself.
    at_rest: float = 0.03
    #: Rate above which no shorter step is tried.
    largest_rate: float = 1e3
    #: Iterations up to which a step is easy.
    easy_iterations: int = 3
    #: Longest step after a failed one, as a share of that one: where walls slide it costs four that hold.
    after_failure: float = 0.7
    #: Factor by which that longest step grows with every step.
    recovery: float = 1.1
    #: Steps before the body counts as one that does not come to rest.
    steps: int = 80
    #: Distance below which a body has not moved between two last steps that failed [mm]: nodes that cannot
    #: settle on either side of an edge do so however long one waits.
    still: float = 0.02
    #: Last steps that may fail in a row from a body that has not moved.
    last_steps: int = 3


@dataclass(frozen=True)
class SolverOptions:
    """All options of the solvers."""

    convergence: ConvergenceOptions = ConvergenceOptions()
    line_search: LineSearchOptions = LineSearchOptions()
    newton: NewtonOptions = NewtonOptions()
    modified_newton: ModifiedNewtonOptions = ModifiedNewtonOptions()
    anderson: AndersonOptions = AndersonOptions()
    inertia_correction: InertiaCorrectionOptions = InertiaCorrectionOptions()
    step_lengthening: StepLengtheningOptions = StepLengtheningOptions()
    continuation: ContinuationOptions = ContinuationOptions()
    viscous_relaxation: ViscousRelaxationOptions = ViscousRelaxationOptions()


DEFAULT = SolverOptions()
