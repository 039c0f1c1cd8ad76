"""This room joins the stages of the way from a recipe to an FMU, and keeps their run folder.

What a stage does is in the room of its name. ``apps`` says what installed apps add to the way; it
names none of them.
"""
