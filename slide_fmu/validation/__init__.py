"""This room measures an FMU beside its reference system: figures, report, model card.

Nothing here is trained or exported.
"""
