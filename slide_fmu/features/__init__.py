"""This room forms network features from the inputs; each module has one set of features.

It knows signals, but no network: features are pure functions of the newest inputs.
"""
