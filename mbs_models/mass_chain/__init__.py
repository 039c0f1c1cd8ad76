"""The mass chain has six masses, cubic springs between them, two forces and three outputs."""

from mbs_models.mass_chain.mass_chain import MassChain

__all__ = ["MassChain"]
