"""Reference systems of the kind "fmu" are FMUs of FMI 2.0 and 3.0, of either interface.

``model`` makes one from a file; fmpy loads it, and its solvers integrate model exchange.
"""
