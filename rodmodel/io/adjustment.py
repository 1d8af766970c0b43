"""Adjustment of a calibration to an individual actuator by ten numbers.

    Π(u, p) = s [ Π_map(u, g p + o) + ½ Σ_k w_k uᵀ W_k u ]

The result is again a ridge network, exactly: gains g and offsets o change the weights of the pressures, the
walls' W_k the quadratic, s the energy scale. As gains differ between chambers, the map's symmetry is lost,
and the ridges of all its images are written out.
"""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rodmodel.actuator import Actuator, Domain, Layout
from rodmodel.error_bound import MOST_NODES, ErrorBound
from rodmodel.io.calibration_file import Calibration
from rodmodel.io.images import biases_at, placed_images, symmetric, turn_matrix
from rodmodel.io.law_arrays import RidgeArrays

if TYPE_CHECKING:
    from rodmodel.io.loading import Found

_TRIANGLE = np.tril_indices(3)


@dataclass(frozen=True)
class OuterWall:
    """Outer wall of a chamber, a third of the tube's; by default that of the calibrated actuator.

    Attributes
    ----------
    radius, thickness : mid-radius and thickness [m].
    shear_modulus : shear modulus at rest [Pa].
    """

    radius: float = 5.5e-3
    thickness: float = 1e-3
    shear_modulus: float = 0.1e6

    def stiffness(self) -> np.ndarray:
        """Return the stiffness of each chamber's outer wall against curvature and twist of the rod's axis.

        The wall is a thin arc of silicone at rest, with φ from −60° to 60° about the chamber's centre. Its
        axial strain is ε = r (u₁ sin φ − u₂ cos φ), its shear r u₃, and with E = 3G

            W_k = ∂²/∂u² ∫ ½ (E ε² + G r² u₃²) t r dφ.

        Returns
        -------
        stiffness : a symmetric matrix for each chamber, (3, 3, 3), body frame [N m²].
        """
        half = math.pi / 3.0
        cube = self.shear_modulus * self.thickness * self.radius**3
        along, across, twist = half + 0.5 * math.sin(2 * half), half - 0.5 * math.sin(2 * half), 2 * half
        local = cube * np.diag([3.0 * across, 3.0 * along, twist])
        into = [turn_matrix(chamber) for chamber in range(3)]
        return np.stack([axes.T @ local @ axes for axes in into])


@dataclass(frozen=True)
class Adjustment:
    """The ten numbers of an adjustment, and the wall to which w refers.

    Attributes
    ----------
    stiffness_scale : factor s on the potential.
    pressure_gain : gain g of each chamber, (3,).
    pressure_offset : offset o of each chamber, (3,) [Pa].
    wall_variation : relative excess stiffness w of each chamber's outer wall, (3,).
    wall : wall with the stiffness W.

    Raises
    ------
    ValueError
        For a number that is not finite, or a scale or a gain that is not positive.
    """

    stiffness_scale: float
    pressure_gain: np.ndarray
    pressure_offset: np.ndarray
    wall_variation: np.ndarray
    wall: OuterWall = OuterWall()

    def __post_init__(self) -> None:
        for name in ("pressure_gain", "pressure_offset", "wall_variation"):
            values = np.array(getattr(self, name), np.float64)
            if values.shape != (3,) or not np.all(np.isfinite(values)):
                raise ValueError(f"{name}: got {values.tolist()}, expected three finite numbers")
            object.__setattr__(self, name, values)
        if not np.all(self.pressure_gain > 0.0):
            raise ValueError(f"pressure_gain: got {self.pressure_gain.tolist()}, expected positive numbers")
        if not (math.isfinite(self.stiffness_scale) and self.stiffness_scale > 0.0):
            raise ValueError(f"stiffness_scale: got {self.stiffness_scale}, expected a positive number")

    def wall_stiffness(self) -> np.ndarray:
        """Return Σ_k w_k W_k, (3, 3) [N m²]."""
        return np.tensordot(self.wall_variation, self.wall.stiffness(), axes=1)

    def domain(self, domain: Domain) -> Domain:
        """Return the map's domain in the actuator's pressures, and in moments of the scaled section."""
        gain, offset = self.pressure_gain, self.pressure_offset
        first, second, third = np.maximum((np.array(domain.pressure_max) - offset) / gain, 0.0).tolist()
        # Unequal gains tilt the planes that bound sums; with the largest gain the bounds are safe.
        total = max(float((domain.pressure_sum_max - offset.sum()) / gain.max()), 0.0)
        share = domain.beside_share
        taken = offset + share * (offset.sum() - offset)
        beside = max(float((domain.beside_max - taken.max()) / gain.max()), 0.0)
        bending, _, torque = (self.stiffness_scale * axis for axis in domain.moment_axes)
        alone, beside_alone = self._single(domain)
        return Domain(
            (first, second, third),
            total,
            bending,
            torque,
            share,
            beside,
            single_max=alone,
            single_beside=beside_alone,
        )

    def _single(self, domain: Domain) -> tuple[tuple[float, float, float], float]:
        """Return the largest pressures of single chambers, and that of the others beside them [Pa].

        The least of the others' readings is safe. Offsets may leave none; then no chamber alone has more.
        """
        beside = float(((domain.single_beside - self.pressure_offset) / self.pressure_gain).min())
        if beside < 0.0:
            return (0.0, 0.0, 0.0), 0.0
        of_map = np.array(domain.single_max)
        alone = np.where(of_map > 0.0, (of_map - self.pressure_offset) / self.pressure_gain, 0.0)
        first, second, third = np.maximum(alone, 0.0).tolist()
        return (first, second, third), beside if alone.max() > 0.0 else 0.0

    def bound(self, bound: ErrorBound) -> ErrorBound:
        """Return the map's bound over the sum of the actuator's pressures.

        With the largest gain the sum inside the map is not below the true one, and the bound is safe.
        """
        gain, offset = float(self.pressure_gain.max()), float(self.pressure_offset.sum())
        readings = [(total - offset) / gain for total in bound.pressure_sum]
        nodes = [0.0, *(reading for reading in readings if reading > 0.0)][-MOST_NODES:]
        both = [bound.without_bend.at(gain * node + offset) for node in nodes]
        return replace(
            bound,
            pressure_sum=tuple(nodes),
            angle=tuple(angle for angle, _ in both),
            tip=tuple(tip for _, tip in both) if bound.tip else (),
        )


def scaled_ends(actuator: Actuator, scale: Any) -> Actuator:
    """Return the ends for a scaled section of the same silicone: the stiffness of the base scales too."""
    if isinstance(actuator.base_stiffness, float | int) and actuator.base_stiffness == 0:
        return actuator  # the turn of the base does not depend on the stiffness
    return replace(actuator, base_stiffness=scale * actuator.base_stiffness)


def adjusted(
    found: "Found", adjustment: Adjustment, error: dict[str, Any], provenance: dict[str, Any]
) -> Calibration:
    """Return the calibration of a layout, adjusted.

    Parameters
    ----------
    found : calibration of the layout, called the map.
    adjustment : the ten numbers.
    error : further entries of `Calibration.error`.
    provenance : provenance of the adjustment.

    Returns
    -------
    calibration : calibration of the requested layout, at one orientation.

    Raises
    ------
    ValueError
        If the offsets leave no pressure of a chamber, or no sum of pressures, inside the map.
    """
    of_map = found.calibration
    domain = adjustment.domain(found.domain)
    if min(*domain.pressure_max, domain.pressure_sum_max, domain.beside_max) <= 0.0:
        raise ValueError(
            f"pressure_offset: got {adjustment.pressure_offset.tolist()} Pa, expected offsets that leave "
            "pressures inside the map in all chambers"
        )
    return Calibration(
        layout=Layout(of_map.layout.name, found.psi, of_map.layout.pitch),
        actuator=scaled_ends(of_map.actuator, adjustment.stiffness_scale),
        law=adjusted_arrays(_written_out(found), adjustment),
        domain=domain,
        bound=None if of_map.bound is None else adjustment.bound(of_map.bound),
        error={**of_map.error, **error},
        provenance={**of_map.provenance, "adjustment": provenance},
    )


def adjusted_arrays(law: RidgeArrays, adjustment: Adjustment) -> RidgeArrays:
    """Return a law without symmetry, adjusted: exactly the formula above, with its constant."""
    gain, offset = adjustment.pressure_gain, adjustment.pressure_offset / law.pressure_scale
    scale, energy = adjustment.stiffness_scale, law.energy_scale
    rest = np.zeros(3) if law.rest_pressures is None else law.rest_pressures
    quadratic = np.zeros(6) if law.quadratic is None else law.quadratic
    in_scales = law.curvature_scale**2 / energy
    # −s V₀ Σ g p differs between chambers: V₀ takes the mean, the slopes the rest.
    rest_volume = law.rest_volume * scale * float(gain.mean())
    remainder = (rest_volume - scale * law.rest_volume * gain) * law.pressure_scale / (scale * energy)

    def with_gain(factors: np.ndarray) -> np.ndarray:
        return np.concatenate([factors[..., :3] * gain, factors[..., 3:]], axis=-1)

    slopes = with_gain(law.slopes)
    slopes[:3] += remainder
    return replace(
        law,
        feature_weights=law.feature_weights * gain,
        feature_biases=law.feature_biases + law.feature_weights @ offset,
        mixing=with_gain(law.mixing),
        offsets=law.offsets + law.mixing[:, :3] @ offset,
        slopes=slopes,
        guess=with_gain(law.guess),
        energy_scale=scale * energy,
        rest_volume=rest_volume,
        rest_pressures=(rest - offset) / gain,
        quadratic=quadratic + in_scales * adjustment.wall_stiffness()[_TRIANGLE],
    )


def _written_out(found: "Found") -> RidgeArrays:
    """Return the law of a layout without symmetry: the ridges and features of all images written out."""
    law = found.calibration.law
    placed = placed_images(law.symmetry, found.turns, found.mirrored)
    biases = law.feature_biases
    if law.orientation_weights is not None:
        biases = biases_at(biases, law.orientation_weights, found.psi)
    biases = np.broadcast_to(biases, (len(placed), law.features))
    share = 1.0 / len(placed)
    # e · p[order] = e[back] · p
    back = [np.argsort(order) for _, order in placed]
    mixing = np.zeros((len(placed) * law.ridges, 3 + len(placed) * law.features))
    for image, own in enumerate(back):
        rows = slice(image * law.ridges, (image + 1) * law.ridges)
        mixing[rows, :3] = law.mixing[:, own]
        mixing[rows, 3 + image * law.features : 3 + (image + 1) * law.features] = law.mixing[:, 3:]
    lower = np.zeros((3, 3))
    lower[_TRIANGLE] = law.factor
    stiffness = share * np.sum([axes.T @ lower @ lower.T @ axes for axes, _ in placed], axis=0)
    guess = [share * axes.T @ law.guess for axes, _ in placed]
    rest, quadratic = law.rest_pressures, law.quadratic
    if rest is not None:
        rest = rest[back[0]]
    if quadratic is not None:
        axes = placed[0][0]
        quadratic = (axes.T @ symmetric(quadratic) @ axes)[_TRIANGLE]
    return RidgeArrays(
        feature_weights=np.concatenate([law.feature_weights[:, own] for own in back]),
        feature_biases=np.concatenate(list(biases)),
        directions=np.concatenate([law.directions @ axes for axes, _ in placed]),
        mixing=mixing,
        offsets=np.tile(law.offsets, len(placed)),
        weights=share * np.tile(law.weights, len(placed)),
        factor=np.linalg.cholesky(stiffness)[_TRIANGLE],
        slopes=np.concatenate(
            [share * sum(law.slopes[own] for own in back), share * np.tile(law.slopes[3:], len(placed))]
        ),
        guess=np.concatenate(
            [sum(g[:, own] for g, own in zip(guess, back, strict=True)), *(g[:, 3:] for g in guess)], axis=1
        ),
        pressure_scale=law.pressure_scale,
        curvature_scale=law.curvature_scale,
        energy_scale=law.energy_scale,
        rest_volume=law.rest_volume,
        rest_pressures=rest,
        quadratic=quadratic,
    )
