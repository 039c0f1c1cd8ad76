"""Reference systems become FMUs, alone or next to their surrogate in one SSP.

The FMUs hold Python and are written with PythonFMU: they run where this Python environment is.
"""
