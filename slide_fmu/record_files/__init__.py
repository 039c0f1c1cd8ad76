"""Files of measured records are read here: CSV, Parquet, HDF5 and MAT become columns over time.

``reading`` makes a ``Record`` of a file, whatever its format. What is wrong in it, and what
becomes of it, is not found here.
"""
