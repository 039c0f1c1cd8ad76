"""This room reads files of measured records (CSV, Parquet, HDF5, MAT, NumPy) as columns over time.

``reading`` makes a ``Record`` of a file of any format. Faults in a record are found, and records
are prepared, in the room ``records``.
"""
