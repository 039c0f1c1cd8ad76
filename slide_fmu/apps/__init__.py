"""Apps stand beside the way from a model to an FMU, one folder each.

An app holds all of its own: its subcommand, its table of the recipe, its report and its pictures.
It is registered by one row of ``[project.entry-points."slide_fmu.apps"]`` in ``pyproject.toml``,
which names its ``App`` (``slide_fmu.pipeline.apps``). No app knows another, and no room knows an
app: to remove one, delete its folder and its row.
"""
