"""A surrogate's FMU beside its reference system: measures, figures, report, model card.

Nothing here is trained or exported.
"""
