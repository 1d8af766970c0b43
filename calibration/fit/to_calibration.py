"""A fitted law with all that a calibration file says about it."""

import math
from collections.abc import Mapping
from typing import Any

from rodmodel import Actuator, Calibration, Domain, Layout, OrientedNetwork, RidgeNetwork

# Platinum-cured silicone of this stiffness; the paper gives no density. The rod in the cavity counts the
# same.
DENSITY = 1070.0  # [kg/m³], as in the runs of the full actuator


def actuator_of(geometry: Mapping[str, float], body_area: float) -> Actuator:
    """Lengths and masses of an actuator.

    Parameters
    ----------
    geometry : fields of `fem_reference.ActuatorGeometry` [m].
    body_area : silicone cross-section of the body [m²].
    """
    rod_area = math.pi / 4 * geometry["cavity_diameter"] ** 2
    cap_area = math.pi / 4 * geometry["body_diameter"] ** 2
    return Actuator(
        body_length=geometry["body_length"],
        cap_length=geometry["cap_length"],
        body_diameter=geometry["body_diameter"],
        mass_per_length=DENSITY * (body_area + rod_area),
        cap_mass=DENSITY * cap_area * geometry["cap_length"],
    )


def calibration_of(
    law: RidgeNetwork | OrientedNetwork,
    domain: Domain,
    error: Mapping[str, Any],
    run: Mapping[str, Any],
    provenance: Mapping[str, Any],
) -> Calibration:
    """Put a calibration together.

    Parameters
    ----------
    law : fitted.
    domain : of the loads inside which the error was measured.
    error : held-out figures of `calibration.fit.held_out_error.figures`.
    run : attributes of the dataset.
    provenance : of the fit; those of the run are added.
    """
    return Calibration(
        layout=_layout(run["layout"], run["winding"], oriented=isinstance(law, OrientedNetwork)),
        actuator=actuator_of(run["geometry"], run["body_area_m2"]),
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
            **provenance,
        },
    )


def _layout(name: str, winding: Mapping[str, float], oriented: bool) -> Layout:
    """Layout for the file, which knows orientation and pitch.

    Rings and no winding have no orientation. Rings go by the pitch of the double helix that crosses a line
    along the rod as often: twice their spacing. No winding goes by the default pitch, and any would do.
    """
    if name == "ring":
        return Layout(name, 0.0, 2.0 * winding["spacing"])
    if name == "none":
        return Layout(name, 0.0, 3e-3)
    return Layout(name, None if oriented else winding["psi"], winding["pitch"])
