"""This room draws inputs; ``kinds.py`` lists all kinds of excitation.

It knows no system. A kind of excitation depends on the signals of the inputs, the sample times and
a random generator only: the same values give the same inputs.
"""
