"""A surrogate as a function that torch or CasADi differentiates in reverse mode.

Only ``functions`` may be imported from outside: it imports neither before somebody asks for it.
"""
