"""Models and kinds of input that nobody prepared, and a judge with solvers of its own.

The models (``beam``, ``bearing``, ``drive``, ``thermal``, ``two_mass``), which are as users write
theirs, and the kinds were written blind, before any figure on them was known. They must stay as
they are: nothing in the package may be tuned on them, and no surrogate may learn from these kinds.
"""
