"""Everything that integrates a system of exudyn: plants, drives, inputs and outputs by their names.

Nothing outside imports it but the kind "exudyn" and models, so that FMUs run without exudyn.
"""
