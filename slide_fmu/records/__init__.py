"""Measured records take the place of a reference system; nothing on the way to an FMU knows them.

``model`` makes a source of data from them, ``rules`` checks and completes their recipes, and
``answers`` has what records answer otherwise than a simulated system.
Learning is not here.
"""
