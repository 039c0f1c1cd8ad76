"""From a surrogate to an FMU in C: model description, compiled libraries, archive.

Neither torch nor exudyn is imported here, and no FMU is run.
"""
