"""This folder fits state-space networks: linear starts, Levenberg-Marquardt, multi-start.

A fit starts from a linear model (``linear_start``), continues with random starts of the hidden
units (``coordinates``, ``multi_start``), and ends with nonlinear least squares
(``levenberg_marquardt``, or ``preconditioned_descent`` for large cells). No other family has code
here.
"""
