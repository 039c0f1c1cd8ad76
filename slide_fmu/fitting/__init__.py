"""This room fits networks in PyTorch, with progress and checkpoints.

What a fit gives is data and needs no torch. Here is nothing that a released FMU needs. How wrong a
fitted network may be is learnt in ``bounds``.
"""
