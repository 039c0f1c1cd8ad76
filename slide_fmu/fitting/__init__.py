"""This room trains networks in PyTorch, with progress and checkpoints, and calibrates them.

Only it, and one module of ``motion.autodiff``, import torch at the top. What a fit gives is a
``Surrogate``, which is data and needs no torch.
"""
