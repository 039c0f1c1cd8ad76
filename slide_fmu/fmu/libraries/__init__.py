"""The compiled libraries: how the C runtime is compiled, and where it lies in an FMU."""
