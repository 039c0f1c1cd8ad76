"""This room makes a fitted network a surrogate that says how wrong it may be.

``fit`` goes the whole way, from trajectories to forecast of inputs, error estimator and error
bound. The network stays as it was fitted in ``fitting``. How estimates and bounds are evaluated is
in ``surrogate``.
"""
