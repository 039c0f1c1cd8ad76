"""This room trains networks in PyTorch, with progress and checkpoints, and calibrates them.

No other room imports torch at the top of its modules. What a fit gives is a ``Surrogate``, which
is data and needs no torch.
"""
