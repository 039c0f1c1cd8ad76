"""This room holds the trained surrogate: window, scalings, network, error estimator, bytes.

A surrogate is the only object that passes from training to export. It needs numpy only.
"""
