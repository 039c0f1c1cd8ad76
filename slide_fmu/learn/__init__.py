"""This package trains networks in PyTorch: fits, their progress and their checkpoints.

No other room imports torch at the top of its modules. What a fit gives is a ``Surrogate``, which
is data and needs no torch.
"""
