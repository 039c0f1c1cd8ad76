"""Training in PyTorch: fits, their progress and their checkpoints.

The only room that imports torch at the top of its modules. What it gives is a ``Surrogate``.
"""
