"""One function for each subcommand, and the run folder that its files go to.

The stages are joined here; what a stage does is in the room of its name.
"""
