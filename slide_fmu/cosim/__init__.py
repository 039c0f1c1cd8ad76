"""Running FMUs: alone, side by side, as a system (SSP), timed, and checked without running.

An FMU is a file here, whoever made it; nothing is measured against a reference.
"""
