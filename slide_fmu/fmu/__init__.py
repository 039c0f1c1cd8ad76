"""This room turns a surrogate into an FMU in C: model description, libraries, archive.

Neither torch nor exudyn is imported here, and no FMU is run.
"""
