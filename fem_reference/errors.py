"""Errors of a solver that does not reach an equilibrium."""


class NewtonError(ArithmeticError):
    """Newton's method gave up; the message says why."""


class UnstableError(NewtonError):
    """The stiffness has more negative eigenvalues than the branch that is followed."""
