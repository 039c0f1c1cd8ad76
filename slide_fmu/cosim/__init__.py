"""This room runs FMUs in an importer, and checks them.

An FMU is a file here; comparisons with a reference are elsewhere.
"""
