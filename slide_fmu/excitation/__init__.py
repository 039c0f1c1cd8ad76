"""How inputs are drawn: one kind of excitation in each module.

No system is known here; a kind knows the ranges of the inputs and a random generator.
"""
