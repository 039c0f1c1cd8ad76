"""Model descriptions of FMI 2.0 and FMI 3.0 list the variables of an FMU."""
