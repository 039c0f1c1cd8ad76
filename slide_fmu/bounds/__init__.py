"""This room learns how wrong a surrogate may be: its error estimator and its error bound.

It begins with the fitted network, which it leaves as it is. ``fit`` goes from a recipe and its
trajectories to the whole surrogate. How networks are fitted is in ``fitting``, and how estimates
and bounds are evaluated is in ``surrogate``.
"""
