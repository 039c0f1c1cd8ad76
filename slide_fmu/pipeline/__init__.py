"""This room joins the stages of the way from a recipe to an FMU, and keeps their run folder.

The work of a stage is in the room of its name. ``apps`` collects the additions of installed apps
without naming any app.
"""
