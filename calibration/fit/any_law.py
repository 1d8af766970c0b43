"""Laws of one orientation of the winding and laws of all, handled alike."""

from jaxtyping import ArrayLike, Float

from rodmodel import OrientedNetwork, SectionLaw

AnyLaw = SectionLaw | OrientedNetwork


def law_at(law: AnyLaw, psi: Float[ArrayLike, ""]) -> SectionLaw:
    """Law of a section; of its orientation ψ [rad], where it is a law of all."""
    return law.at_psi(psi) if isinstance(law, OrientedNetwork) else law
