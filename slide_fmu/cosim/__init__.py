"""This room runs FMUs, alone, side by side or as a system (SSP), and times and checks them.

An FMU is a file here; nothing is measured against a reference.
"""
