"""This room has the network families in numpy: evaluation, bytes and derivatives.

``bytes.py`` registers them. Each is a package with its network, its byte layout and its gradient.
``activations.py`` and ``state_space/equations.py`` hold the formulas that numpy here and torch in
``fitting`` share. Training is in ``fitting``; units of measure are in ``surrogate``.
"""
