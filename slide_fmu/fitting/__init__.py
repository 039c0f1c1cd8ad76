"""This room fits networks in PyTorch, with progress and checkpoints.

A fit returns data that need no torch. Released FMUs need nothing from here. The error of a fitted
network is learnt in ``bounds``.
"""
