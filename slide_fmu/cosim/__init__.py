"""This room runs FMUs in an importer, and checks them.

An FMU is a file here; nothing is measured against a reference.
"""
