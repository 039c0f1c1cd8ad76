"""Everything that integrates a system of exudyn: plants, drives, and wires to its signals.

Nothing outside imports it but the kind "exudyn" and models, so that FMUs run without exudyn.
"""
