"""Recipes: their typed tables, how they are read, and the systems that they name.

Nothing is simulated, learnt or written here; a recipe that cannot work is refused.
"""
