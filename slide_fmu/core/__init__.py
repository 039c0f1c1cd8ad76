"""This room holds signals, the window, scalings, units, measures of error, files and progress.

The folder ``web`` has what all HTML pages share: charts as plain values, and the code that draws
them.

This room imports nothing of slide_fmu. Code that knows a network, a system or an FMU does not
belong here.
"""
