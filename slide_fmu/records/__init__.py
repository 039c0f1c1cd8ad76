"""Measured records are read, examined, cut, and divided into parts, as functions on plain data.

``reading`` makes records from files, ``findings`` shows what is wrong with them, ``preparation``
makes even trajectories of them, ``repeats`` finds inputs that come again, and ``division`` makes
training, validation and test of them. Learning is not here.
"""
