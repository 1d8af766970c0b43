"""Calibration of a fitted law: actuator, layout, domain, error and provenance."""

import math
from collections.abc import Mapping
from typing import Any

from fem_reference import parse_design
from fem_reference.design import DENSITY
from rodmodel import Actuator, Calibration, Domain, Layout, OrientedNetwork, RidgeNetwork


def actuator_of(geometry: Mapping[str, float], body_area: float, density: float) -> Actuator:
    """Return lengths and masses of an actuator.

    Parameters
    ----------
    geometry : fields of `fem_reference.ActuatorGeometry` [m].
    body_area : silicone cross-section of the body [m²].
    density : of silicone and core [kg/m³].
    """
    rod_area = math.pi / 4 * geometry["cavity_diameter"] ** 2
    cap_area = math.pi / 4 * geometry["body_diameter"] ** 2
    return Actuator(
        body_length=geometry["body_length"],
        cap_length=geometry["cap_length"],
        body_diameter=geometry["body_diameter"],
        mass_per_length=density * (body_area + rod_area),
        cap_mass=density * cap_area * geometry["cap_length"],
    )


def calibration_of(
    law: RidgeNetwork | OrientedNetwork,
    domain: Domain,
    error: Mapping[str, Any],
    run: Mapping[str, Any],
    provenance: Mapping[str, Any],
) -> Calibration:
    """Build a calibration.

    Parameters
    ----------
    law : fitted law.
    domain : domain of the held-out error.
    error : held-out errors from `calibration.fit.held_out_error.figures`.
    run : attributes of the dataset.
    provenance : provenance of the fit; that of the run is added.
    """
    return Calibration(
        layout=_layout(run["layout"], run["winding"], oriented=isinstance(law, OrientedNetwork)),
        actuator=actuator_of(run["geometry"], run["body_area_m2"], _density(run)),
        section_law=law,
        domain=domain,
        error=error,
        provenance={
            "run_command": run["command"],
            "run_code_version": run["code_version"],
            "run_date": run["date"],
            "mesh": run["mesh"],
            "end_compliance_m_per_n": run["end_compliance"],
            "material": run["material"],
            "geometry_m": run["geometry"],
            **({"design": run["design"]} if "design" in run else {}),
            **provenance,
        },
    )


def _density(run: Mapping[str, Any]) -> float:
    """Return the density of a run's design [kg/m³]; runs from before designs have that of all silicones."""
    if "design" not in run:
        return DENSITY
    return parse_design(run["design"], "attributes: design").density


def _layout(name: str, winding: Mapping[str, float], oriented: bool) -> Layout:
    """Return the layout for the file, with orientation and pitch.

    Rings have no orientation; their pitch is twice their spacing, that of a double helix which crosses a line
    along the rod as often. Without a winding the pitch has no meaning and gets the default.
    """
    if name == "ring":
        return Layout(name, 0.0, 2.0 * winding["spacing"])
    if name == "none":
        return Layout(name, 0.0, 3e-3)
    return Layout(name, None if oriented else winding["psi"], winding["pitch"])
