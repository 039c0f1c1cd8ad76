"""This room reads recipes into typed tables, and finds the systems that they name.

Nothing is simulated, learnt or written here; a recipe that cannot work is refused.
"""
