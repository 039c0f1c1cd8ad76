"""Physical parameters of a surrogate are fitted to measured records, with their uncertainty.

Nothing is trained here: the surrogate stays as it is, and nothing needs torch.
"""
