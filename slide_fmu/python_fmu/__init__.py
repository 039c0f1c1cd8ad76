"""This room writes FMUs that hold Python: reference systems, and recorded inputs.

They are written with PythonFMU. What needs no Python where it runs is in ``fmu``.
"""
