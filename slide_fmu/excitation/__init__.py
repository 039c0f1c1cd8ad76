"""This room draws inputs; each module has one kind of excitation.

No system is known here. A kind of excitation knows the signals of the inputs, the sample times and
a random generator, and it gives the same inputs whenever these are the same.
"""
