"""Measured records: reading, examining, cutting and splitting them, as functions on plain data.

``reading`` makes records from files, ``examination`` finds what is wrong with them,
``preparation`` makes even trajectories of them, ``splitting`` divides those into training,
validation and test. Learning is not here.
"""
