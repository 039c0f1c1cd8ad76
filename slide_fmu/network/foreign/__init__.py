"""Networks that were trained elsewhere: layers of torch and of ONNX become a feed-forward network.

``chain.py`` makes the network from steps; ``torch_layers.py`` and ``onnx_nodes.py`` read them, and
are the only modules here that import torch and onnx.
"""
