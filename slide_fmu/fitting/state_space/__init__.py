"""This folder fits state-space networks: linear starts, Levenberg-Marquardt, multi-start.

The way goes from a linear model (``linear_start``) over random starts of the hidden units
(``coordinates``, ``multi_start``) to nonlinear least squares (``levenberg_marquardt``, or
``preconditioned_descent`` for large cells). Nothing of other families belongs here.
"""
