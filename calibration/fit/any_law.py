"""Common access to laws of a single orientation of the winding and of all orientations."""

from jaxtyping import ArrayLike, Float

from rodmodel import OrientedNetwork, SectionLaw

AnyLaw = SectionLaw | OrientedNetwork


def law_at(law: AnyLaw, psi: Float[ArrayLike, ""]) -> SectionLaw:
    """Return the law of a section, at its orientation ψ [rad] for a law of all orientations."""
    return law.at_psi(psi) if isinstance(law, OrientedNetwork) else law
