"""Networks that were trained elsewhere, in torch or in an ONNX file, become surrogates.

``chain`` makes a feed-forward network of steps. ``torch_layers`` and ``onnx_nodes`` read the
steps; only they import torch and onnx.
"""
