"""This room trains networks in PyTorch, with progress and checkpoints, and error bounds.

Only it, the reader of layers of torch in ``network.foreign``, and one module of the app
``autodiff`` import torch at the top. What a fit gives is a ``Surrogate``, which is data and needs
no torch.
"""
