"""Reference systems of the kind "exudyn" are here, with the integration that all of them share.

``model`` makes one from a user's file; ``plant`` is the only module that calls exudyn's solvers.
"""
