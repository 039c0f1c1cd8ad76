"""This room measures an FMU against its reference system, and returns figures.

Nothing here is trained or exported, and nothing is shown (that is ``report``).
"""
