"""FMUs of any tool are coupled and run together: a co-simulation master, in Python and for SSP."""
