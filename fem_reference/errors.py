"""Errors of a solver that finds no equilibrium."""


class NewtonError(ArithmeticError):
    """Newton's method does not converge; the message says why."""


class UnstableError(NewtonError):
    """The stiffness has more negative eigenvalues than on the followed branch."""
