"""This room trains networks in PyTorch, with progress and checkpoints, and error bounds.

Only it, and one module of the app ``autodiff``, import torch at the top. What a fit gives is a
``Surrogate``, which is data and needs no torch.
"""
