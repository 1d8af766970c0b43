"""Motion of the actuator's points in long steps: means along the core, and what blocks a step (mm)."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from fem_reference.actuator.equations import ActuatorEquations
from fem_reference.central_rod import PRESSED, CoreCoordinates
from fem_reference.walls import ContactPath

# Share of the way to where walls meet that a step takes.
_WALL_MARGIN = 0.6
# Largest displacement that keeps walls apart [mm].
_MOST_MOVED = 0.05

Points = Float[np.ndarray, "points 3"]


class BodyMotion:
    """Steps in the core's coordinates, walls and cavity kept apart.

    Parameters
    ----------
    equations : of the actuator.
    """

    def __init__(self, equations: ActuatorEquations) -> None:
        self._equations = equations
        self._coordinates = CoreCoordinates(equations.basis, equations.mesh.points[:, 2])
        self._cavity = equations.sliding
        self._pressed = self._coordinates.distance(equations.rest_positions, self._cavity) - PRESSED
        self._behind = _behind(equations.mesh.points, self._cavity, equations.inner_radius)

    def mean(self, positions: list[Points], weights: list[float]) -> Points:
        """Weighted mean of positions, taken in the core's coordinates."""
        mean = self._coordinates.mean(positions, weights)
        clamped = self._equations.clamped
        mean[clamped] = self._equations.rest_positions[clamped]
        return mean

    def keep_core_apart(self, start: Points, end: Points) -> Points:
        """``end`` with the cavity's wall no deeper in the core than at ``start``, or than a pressed wall is.

        A Newton step does not foresee contact. A wall that it brings 0.03 mm too deep into the core meets a
        contact pressure of 3 MPa, and the matrix has hundreds of negative pivots, as the wall slides off.
        """
        least = np.minimum(self._coordinates.distance(start, self._cavity), self._pressed)
        moved = self._coordinates.keep_core_apart(end, self._cavity, least)
        nodes, nearest, share = self._behind
        positions = end.copy()
        positions[nodes] += share[:, None] * moved[nearest]
        return self._equations.symmetrised(positions)

    def keep_walls_apart(self, start: Points, end: Points) -> Points | None:
        """``end`` with walls moved apart that the step would bring through each other.

        None if there are no such walls, or if some would move far: that would crush the elements behind them,
        and then cost more iterations than a shorter step.
        """
        nodes = slice(self._equations.nodes)
        path = self.candidate_positions(start, end)
        moves = self._equations.walls.keep_walls_apart(start[nodes], end[nodes], path)
        if moves is None or float(np.abs(moves).max()) > _MOST_MOVED:
            return None
        moved = end.copy()
        moved[nodes] += moves
        return self._equations.symmetrised(moved)

    def allowed(self, start: Points, end: Points, least_dilatation: float) -> float:
        """Share of a step before walls meet; half if the core or an element blocks it."""
        equations = self._equations
        nodes = slice(equations.nodes)
        path = self.candidate_positions(start, end)
        limit = equations.walls.step_limit(start[nodes], end[nodes], path)
        if limit < 1.0:
            return _WALL_MARGIN * limit
        good = (
            equations.contact.admissible(end)
            and equations.solid.dilatation(end)[:, 0].min() > least_dilatation
        )
        return 1.0 if good else 0.5

    def candidate_positions(self, start: Points, end: Points) -> ContactPath:
        """Both ends of a step in the core's coordinates, for the search of wall pairs that may touch.

        Sections move by millimetres, but the walls in them by hundredths of a millimetre. With the sections'
        motion taken off, the search finds a hundredth of the pairs.
        """
        return self._coordinates.straightened(start), self._coordinates.straightened(end)


def _behind(
    rest: Float[np.ndarray, "nodes 3"], cavity: Int[np.ndarray, " some"], inner_radius: float
) -> tuple[Int[np.ndarray, " inner"], Int[np.ndarray, " inner"], Float[np.ndarray, " inner"]]:
    """Nodes of the inner wall, the cavity's node in front of each, and the share of its motion.

    The share is one at the cavity and zero where chambers begin, so that a wall that is moved off the core
    does not crush the elements next to it.
    """

    def by_section(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        # Sections are farther apart than any two places around the core.
        return np.column_stack([points[:, :2] / np.hypot(*points[:, :2].T)[:, None], 100.0 * points[:, 2]])

    radius = np.hypot(*rest[:, :2].T)
    highest = rest[cavity, 2].max(initial=-np.inf)
    inner = np.flatnonzero((radius < inner_radius) & (rest[:, 2] <= highest))
    if len(inner) == 0:
        return inner, inner, np.zeros(0)
    _, nearest = cKDTree(by_section(rest[cavity])).query(by_section(rest[inner]))
    own = radius[cavity][nearest]
    return inner, nearest, (inner_radius - radius[inner]) / (inner_radius - own)
