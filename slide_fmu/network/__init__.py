"""This room has the network families in numpy: evaluation, bytes and derivatives.

Nothing here is trained (that is ``learn``) and nothing has units (that is ``surrogate``).
"""
