"""This room reads measured records, examines them, cuts them and divides them into parts.

``reading`` makes records from files, ``examination`` finds what is wrong with them,
``preparation`` makes even trajectories of them, ``splitting`` divides those into training,
validation and test. Learning is not here.
"""
