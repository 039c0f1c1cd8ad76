"""Reference systems of the kind "exudyn", and the integration that all exudyn models share.

``model`` makes one from a user's file; ``plant`` is the only module that calls exudyn's solvers.
"""
