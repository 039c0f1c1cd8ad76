"""Six masses in a row, joined by cubic springs, with two forces and three measured positions."""

from mbs_models.mass_chain.mass_chain import MassChain

__all__ = ["MassChain"]
