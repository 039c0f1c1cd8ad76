"""This room trains networks in PyTorch, with progress and checkpoints.

The only room that imports torch at the top of its modules. What it gives is a ``Surrogate``.
"""
