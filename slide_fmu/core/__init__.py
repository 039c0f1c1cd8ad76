"""This room holds signals, the window, scalings, units, measures of error, files and progress.

In ``web`` is what pages of HTML share: charts as plain values, and what draws them.

Imports nothing of slide_fmu. What knows a network, a system or an FMU does not belong here.
"""
