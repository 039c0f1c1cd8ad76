"""This room draws training trajectories, makes them in parallel and stores them.

A sample of a data set is a trajectory, not a window: splits go by trajectory. Nothing here depends
on networks.
"""
