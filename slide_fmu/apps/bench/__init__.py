"""An FMU is timed: its steps through FMPy, and batches of windows in the runtime and in numpy."""
