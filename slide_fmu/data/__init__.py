"""This package makes training trajectories: they are drawn, simulated in parallel and stored.

A sample of a data set is a trajectory, not a window: splits go by trajectory. Nothing here knows a
network.
"""
