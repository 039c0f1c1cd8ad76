"""What a reference system is, and how one is made from its name.

The models themselves are elsewhere: in ``mbs_models``, or the user's own.
"""
