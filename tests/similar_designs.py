"""Designs that are similar to others: all lengths times one number, all moduli times another."""

from dataclasses import replace

from fem_reference.design import Design
from fem_reference.geometry import Core
from fem_reference.materials import Ogden


def scaled(design: Design, length: float, modulus: float) -> Design:
    """The design with all lengths and all moduli scaled, its ends too, and its density as it is."""
    geometry, law, compliance = design.geometry, design.material, design.end_compliance
    assert isinstance(law, Ogden)
    lengths = {
        name: length * value for name, value in vars(geometry).items() if name != "outer_wall_variation"
    }
    advance = {name: length * value for name, value in vars(design.winding).items() if name != "psi"}
    return replace(
        design,
        geometry=replace(geometry, **lengths),
        material=replace(
            law,
            shear_moduli=tuple(modulus * mu for mu in law.shear_moduli),
            bulk_modulus=modulus * law.bulk_modulus,
        ),
        core=Core(modulus * design.core.young_modulus),
        thread=replace(
            design.thread,
            young_modulus=modulus * design.thread.young_modulus,
            radius=length * design.thread.radius,
        ),
        winding=replace(design.winding, **advance),
        end_compliance=None if compliance is None else compliance / (modulus * length),
    )
