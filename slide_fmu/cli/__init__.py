"""This room has what users call: the console script ``slide-fmu``, and the same in Python.

``recipe_commands`` and ``fmu_commands`` have one function for each subcommand of the way; ``app``
lists them. ``python_calls`` has the public functions that do the same. Nothing here computes
anything or writes a file, except for figures as JSON.
"""

import sys


def main() -> None:
    """Run the console script, and say so where it ends before anything else can say it."""
    try:
        from slide_fmu.cli.app import main as run
    except KeyboardInterrupt:
        sys.stderr.write("stopped\n")
        raise SystemExit(130) from None
    run()
