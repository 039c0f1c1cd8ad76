"""Training trajectories: how they are drawn, made in parallel, and stored.

A sample is a trajectory, not a window; nothing here knows a network.
"""
