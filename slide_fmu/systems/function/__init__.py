"""Reference systems of the kind "function" are equations, or a simulation, in Python.

``model`` makes one from a user's file; ``system`` integrates f and g, ``record`` calls a whole
simulation.
"""
