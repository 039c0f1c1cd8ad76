"""This room has one function for each subcommand, and the run folder for their files.

The stages are joined here; what a stage does is in the room of its name.
"""
