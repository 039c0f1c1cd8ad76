"""This room draws training trajectories, makes them in parallel and stores them.

A sample is a trajectory, not a window; nothing here knows a network.
"""
