"""Apps are additions to the way from a model to an FMU, with one folder each.

An app has its own subcommand, table of the recipe, report and pictures. It is registered by one
row of ``[project.entry-points."slide_fmu.apps"]`` in ``pyproject.toml``, which names its ``App``
(``slide_fmu.pipeline.apps``). No app imports another, and no room imports an app: to remove one,
delete its folder and its row.
"""
