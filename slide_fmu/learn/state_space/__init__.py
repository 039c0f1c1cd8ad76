"""The fit of state-space networks: linear starts, Levenberg-Marquardt, multi-start.

Nothing of other families belongs here.
"""
