"""This room writes FMUs that hold Python: reference systems, recorded inputs, torch modules.

They are written with PythonFMU. What needs no Python where it runs is in ``fmu``.
"""
