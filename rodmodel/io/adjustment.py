"""A calibration adjusted to an actuator of one's own by ten numbers: a calibration again.

    Π(u, p) = s [ Π_map(u, g p + o) + ½ Σ_k w_k uᵀ W_k u ]

In a network of ridges all of it is exact: gains and offsets go into what takes the pressures, the walls' W_k
into the quadratic, s into the scale of energies. Gains differ from chamber to chamber, so that the ridges of
all images of the map's symmetry are written out.
"""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rodmodel.actuator import Actuator, Domain, Layout
from rodmodel.io.calibration_file import Calibration
from rodmodel.io.images import biases_at, placed_images, symmetric, turn_matrix
from rodmodel.io.law_arrays import RidgeArrays

if TYPE_CHECKING:
    from rodmodel.io.loading import Found

_TRIANGLE = np.tril_indices(3)


@dataclass(frozen=True)
class OuterWall:
    """Third of the tube's outer wall that closes a chamber; by default that of the calibrated actuator.

    Mid-radius [m], thickness [m] and shear modulus at rest [Pa].
    """

    radius: float = 5.5e-3
    thickness: float = 1e-3
    shear_modulus: float = 0.1e6

    def stiffness(self) -> np.ndarray:
        """Stiffness of each chamber's outer wall against curvature and twist, about the rod's axis.

        Of a thin arc of silicone at rest, r(φ) its place and φ from −60° to 60° about the chamber's centre:
        its axial strain is ε = r (u₁ sin φ − u₂ cos φ), its shear r u₃, and with E = 3G

            W_k = ∂²/∂u² ∫ ½ (E ε² + G r² u₃²) t r dφ.

        Returns
        -------
        stiffness : (3, 3, 3), a symmetric matrix for each chamber, body frame [N m²].
        """
        half = math.pi / 3.0
        cube = self.shear_modulus * self.thickness * self.radius**3
        along, across, twist = half + 0.5 * math.sin(2 * half), half - 0.5 * math.sin(2 * half), 2 * half
        local = cube * np.diag([3.0 * across, 3.0 * along, twist])
        into = [turn_matrix(chamber) for chamber in range(3)]
        return np.stack([axes.T @ local @ axes for axes in into])


@dataclass(frozen=True)
class Adjustment:
    """The ten numbers, and the wall that w counts in.

    Attributes
    ----------
    stiffness_scale : s.
    pressure_gain : g of each chamber, (3,).
    pressure_offset : o of each chamber, (3,) [Pa].
    wall_variation : w of each chamber, (3,).
    wall : whose stiffness W is.

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
        """Σ_k w_k W_k, (3, 3) [N m²]."""
        return np.tensordot(self.wall_variation, self.wall.stiffness(), axes=1)

    def domain(self, domain: Domain) -> Domain:
        """Domain of the map in pressures as they are read, and in moments of the scaled section."""
        gain, offset = self.pressure_gain, self.pressure_offset
        first, second, third = np.maximum((np.array(domain.pressure_max) - offset) / gain, 0.0).tolist()
        # With unequal gains the bound on the sum is a plane of another slope: the largest gain is the safe
        # one.
        total = max(float((domain.pressure_sum_max - offset.sum()) / gain.max()), 0.0)
        bending, _, torque = (self.stiffness_scale * axis for axis in domain.moment_axes)
        return Domain((first, second, third), total, bending, torque)


def scaled_ends(actuator: Actuator, scale: Any) -> Actuator:
    """Ends of the same silicone as the section: what they hold back scales as its stiffness does."""
    if isinstance(actuator.base_stiffness, float | int) and actuator.base_stiffness == 0:
        return actuator  # the same for all, whatever the scale
    return replace(actuator, base_stiffness=scale * actuator.base_stiffness)


def adjusted(
    found: "Found", adjustment: Adjustment, error: dict[str, Any], provenance: dict[str, Any]
) -> Calibration:
    """Make a calibration of one that serves a layout, and an adjustment.

    Parameters
    ----------
    found : the map, and how the layout's section stands to its own.
    adjustment : the ten numbers.
    error : further figures of `Calibration.error`.
    provenance : of the adjustment.

    Returns
    -------
    calibration : of the layout that was asked for. Where the map is one of all orientations, of the one.

    Raises
    ------
    ValueError
        Where no pressure of a chamber, or no sum of them, is left inside the map.
    """
    of_map = found.calibration
    domain = adjustment.domain(found.domain)
    if min(*domain.pressure_max, domain.pressure_sum_max) <= 0.0:
        raise ValueError(
            f"pressure_offset: got {adjustment.pressure_offset.tolist()} Pa, expected offsets that leave "
            "pressures inside the map in all chambers"
        )
    return Calibration(
        layout=Layout(of_map.layout.name, found.psi, of_map.layout.pitch),
        actuator=scaled_ends(of_map.actuator, adjustment.stiffness_scale),
        law=adjusted_arrays(_written_out(found), adjustment),
        domain=domain,
        error={**of_map.error, **error},
        provenance={**of_map.provenance, "adjustment": provenance},
    )


def adjusted_arrays(law: RidgeArrays, adjustment: Adjustment) -> RidgeArrays:
    """Law without symmetry, adjusted: exactly the formula above, its constant included."""
    gain, offset = adjustment.pressure_gain, adjustment.pressure_offset / law.pressure_scale
    scale, energy = adjustment.stiffness_scale, law.energy_scale
    rest = np.zeros(3) if law.rest_pressures is None else law.rest_pressures
    quadratic = np.zeros(6) if law.quadratic is None else law.quadratic
    in_scales = law.curvature_scale**2 / energy
    # −s V₀ Σ g p of chambers that differ: with one V₀ for all, the rest of it among the slopes.
    rest_volume = law.rest_volume * scale * float(gain.mean())
    share = (rest_volume - scale * law.rest_volume * gain) * law.pressure_scale / (scale * energy)

    def seen(factors: np.ndarray) -> np.ndarray:
        return np.concatenate([factors[..., :3] * gain, factors[..., 3:]], axis=-1)

    slopes = seen(law.slopes)
    slopes[:3] += share
    return replace(
        law,
        feature_weights=law.feature_weights * gain,
        feature_biases=law.feature_biases + law.feature_weights @ offset,
        mixing=seen(law.mixing),
        offsets=law.offsets + law.mixing[:, :3] @ offset,
        slopes=slopes,
        guess=seen(law.guess),
        energy_scale=scale * energy,
        rest_volume=rest_volume,
        rest_pressures=(rest - offset) / gain,
        quadratic=quadratic + in_scales * adjustment.wall_stiffness()[_TRIANGLE],
    )


def _written_out(found: "Found") -> RidgeArrays:
    """The law of a layout with the ridges and hidden functions of all its images, without symmetry."""
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
