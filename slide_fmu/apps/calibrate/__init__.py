"""Physical parameters of a surrogate are fitted to measured records, with their uncertainty.

The surrogate itself stays unchanged: nothing is trained, and torch is not needed.
"""
