"""This room holds the trained surrogate: window, scalings, network, error estimator, bytes.

It is the only thing that crosses from learning to export. It needs numpy alone.
"""
