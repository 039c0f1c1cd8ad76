"""This room says what a reference system is, and makes one from its name.

The models themselves are elsewhere: in ``mbs_models``, or the user's own.
"""
