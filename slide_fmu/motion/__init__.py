"""This room chooses motions with a surrogate: set points that excite the system little.

A motion goes from rest to rest. Its coordinates are what a user thinks in (``coordinates``); it
comes from a family that keeps its limits (``limits``, ``profile``), is answered by the surrogate
(``response``), beside what is usual in the field (``shapers``), and may be optimised (``shape``).
"""
