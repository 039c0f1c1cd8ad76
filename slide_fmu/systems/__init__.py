"""This room defines reference systems, and makes one from its name.

The models themselves are elsewhere: in ``mbs_models``, or the user's own.
"""
