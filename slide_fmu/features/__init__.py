"""This room forms what a network sees of the inputs; each module has one set of features.

No network is known here, only signals: features are pure functions of the newest inputs.
"""
