"""This room holds what users call: the console script ``slide-fmu``, and its like in Python.

``recipe_commands`` and ``fmu_commands`` hold one function for each subcommand of the way, ``app``
the list of them. ``python_calls`` and ``learning`` are the public functions that do the same.
Nothing here computes anything or writes a file, except for the figures that ``--json`` asks for.
"""

import sys


def main() -> None:
    """Run the console script, and say so where it ends before anything else can say it."""
    try:
        from slide_fmu.pipeline.apps import AppError

        try:
            from slide_fmu.cli.app import main as run
        except AppError as error:
            sys.stderr.write(f"error: {error}\n")
            raise SystemExit(1) from None
    except KeyboardInterrupt:
        sys.stderr.write("stopped\n")
        raise SystemExit(130) from None
    run()
