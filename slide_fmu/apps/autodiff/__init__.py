"""A surrogate becomes a function that torch or CasADi differentiates in reverse mode.

Other code may import only ``functions``: it imports torch or CasADi only when they are needed.
"""
