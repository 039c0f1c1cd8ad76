"""This room turns a surrogate into an FMU in C: model description, libraries, archive.

It imports neither torch nor exudyn, and runs no FMU.
"""
