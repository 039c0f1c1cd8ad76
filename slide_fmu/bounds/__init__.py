"""This room completes a fitted network to a surrogate that knows its own error.

``fit`` has all stages, from trajectories to forecast of inputs, error estimator and error bound.
The network itself is fitted in ``fitting`` and stays unchanged. Estimates and bounds are evaluated
in ``surrogate``.
"""
