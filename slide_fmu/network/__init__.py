"""Network families in numpy: their evaluation, their bytes and their derivatives.

Nothing here is trained (that is ``learn``) and nothing has units (that is ``surrogate``).
"""
