"""This room draws inputs; each module has one kind of excitation.

No system is known here; a kind knows the ranges of the inputs and a random generator.
"""
