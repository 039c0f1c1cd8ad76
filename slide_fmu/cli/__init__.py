"""The console script ``slide-fmu``: verbs only, no logic.

Verbs import their stages when they are called: who exports an FMU need not wait for what trains
networks and draws figures.
"""

from slide_fmu.cli import fmu_verbs, recipe_verbs
from slide_fmu.cli.app import app

__all__ = ["app", "fmu_verbs", "main", "recipe_verbs"]


def main() -> None:
    """Entry point of the console script."""
    app()
