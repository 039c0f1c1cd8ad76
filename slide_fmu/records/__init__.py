"""Measured records take the place of a reference system; nothing on the way to an FMU knows them.

``model`` makes a source of them, ``rules`` says what their recipes may say, and ``answer_table``
where they answer otherwise than a system that is simulated. Learning is not here.
"""
