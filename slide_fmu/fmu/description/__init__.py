"""Model descriptions of FMI 2.0 and FMI 3.0: what an FMU says about its variables."""
