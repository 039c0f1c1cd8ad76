"""The stages from a recipe to an FMU with a report, each usable alone."""
