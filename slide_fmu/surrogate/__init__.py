"""The trained surrogate: window, scalings, network, error estimator, and their bytes.

It is the only thing that crosses from learning to export. It needs numpy alone.
"""
