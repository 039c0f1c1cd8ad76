"""This room holds the trained surrogate: window, scalings, network, error estimator, bytes.

It is the only thing that crosses from learning to export. It needs numpy alone, but where
``from_torch`` makes it of a network that torch or ONNX has.
"""
