"""The subcommands: one module for each, which reads its options and prints what came of it.

What a subcommand does is in the room of its name, or in ``pipeline``. Modules import that when
they are called: who exports an FMU need not wait for what trains networks and draws figures.
"""
