"""Reference systems become FMUs, alone or next to their surrogate in one SSP.

The FMUs contain Python and are written with PythonFMU: they run in this Python environment.
"""
