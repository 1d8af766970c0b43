"""Torsional stiffness of a law, carried from the mesh of its sweep to the limit of fine meshes.

Hexahedra hold threads together where these cross, and are too stiff in torsion by much the same share at all
pressures. The refinement study tells the ratio of the limit to the mesh, of the paper's actuator
(`MeshLimits.torsion_ratio`). With s the root of that ratio,

    Π'(u₁, u₂, u₃, p) = Π(u₁, u₂, s u₃, p)

has s² of the law's torsional stiffness, the same bending, and is as stable. The errors in the file stay those
of the law against the sweep's states on their mesh: `on_its_mesh` returns that law.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from calibration.truth.mesh_limits import MeshLimits, load_limits
from fem_reference import Design, similarity
from rodmodel import Calibration

# Largest relative difference of a design from the paper's, its winding apart.
_SAME_DESIGN = 1e-3

# Entries 31, 32 and 33 of a lower triangle by rows.
_OF_TORSION = slice(3, 6)


def torsion_ratio(calibration: Calibration) -> float:
    """Return the ratio that a file's law has been carried by; 1 if it is as fitted to its mesh."""
    note: Any = calibration.provenance.get("torsion")
    return float(note["ratio"]) if note is not None else 1.0


def carried(calibration: Calibration, note: Mapping[str, Any]) -> Calibration:
    """Return a calibration whose law has another torsional stiffness than its mesh gave.

    Laws after a snap stay as they are: the study has no state of theirs.

    Parameters
    ----------
    calibration : calibration, whose law may have been carried before.
    note : for the provenance, with the new ``ratio`` of the torsional stiffness to that on the mesh.
    """
    made = _stiffened(calibration, float(note["ratio"]) / torsion_ratio(calibration))
    return replace(made, provenance={**calibration.provenance, "torsion": dict(note)})


def at_limit(calibration: Calibration, design: Design, note: Mapping[str, Any]) -> Calibration:
    """Return a calibration with the torsional stiffness of the limit, or itself where that is not known.

    Parameters
    ----------
    calibration : calibration of the paper's actuator or another one.
    design : its design.
    note : for the provenance, to which the ratio is added.
    """
    mesh = calibration.provenance.get("mesh")
    found = load_limits().torsion_ratio(calibration.layout, mesh) if isinstance(mesh, str) else None
    of_the_study = replace(Design(), winding=design.winding)
    if found is None or not similarity(design, of_the_study).within(_SAME_DESIGN):
        return calibration
    if found.ratio == torsion_ratio(calibration):
        return calibration
    return carried(calibration, {**note, **asdict(found)})


def on_its_mesh(calibration: Calibration) -> Calibration:
    """Return a calibration with the law as it was fitted to the states on its mesh."""
    kept = {name: value for name, value in calibration.provenance.items() if name != "torsion"}
    return replace(_stiffened(calibration, 1.0 / torsion_ratio(calibration)), provenance=kept)


def on_mesh(calibration: Calibration, mesh: str, limits: MeshLimits) -> Calibration:
    """Return a calibration with the torsional stiffness that its winding has on a mesh.

    One that has not been carried to the limit, or a mesh that the study does not know, leaves it as it is.
    """
    ratio = limits.torsion_ratio(calibration.layout, mesh)
    if ratio is None or "torsion" not in calibration.provenance:
        return calibration
    return _stiffened(calibration, 1.0 / ratio.ratio)


def _stiffened(calibration: Calibration, ratio: float) -> Calibration:
    if ratio == 1.0:
        return calibration
    law, domain, s = calibration.law, calibration.domain, math.sqrt(ratio)
    directions, factor, guess = (np.array(each) for each in (law.directions, law.factor, law.guess))
    directions[:, 2] *= s
    factor[_OF_TORSION] *= s
    guess[2] /= s
    return replace(
        calibration,
        law=replace(law, directions=directions, factor=factor, guess=guess),
        domain=replace(domain, torque_max=s * float(domain.moment_axes[2])),
    )
