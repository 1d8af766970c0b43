"""Fixtures of the finite elements' tests."""

from tests.fem_fixtures import bending_path, cell, equations, small_cell

__all__ = ["bending_path", "cell", "equations", "small_cell"]
