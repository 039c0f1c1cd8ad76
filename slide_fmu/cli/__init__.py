"""This room holds the console script ``slide-fmu``: subcommands only, no logic.

``recipe_commands`` and ``fmu_commands`` hold one function for each subcommand, ``app`` the list of
them. Nothing here computes anything or writes a file, beside the figures that ``--json`` asks for.
"""

import sys

try:
    from slide_fmu.cli.app import app, main
except KeyboardInterrupt:  # nothing is there yet that could say so
    sys.stderr.write("stopped\n")
    raise SystemExit(130) from None

__all__ = ["app", "main"]
