"""This app chooses motions with a surrogate: set points that excite the system little.

A motion goes from rest to rest. Its coordinates are what users specify (``coordinates``). It comes
from a family that keeps its limits (``limits``, ``profile``), the surrogate predicts its response
(``response``), it is compared with usual methods (``shapers``), and it may be optimised
(``shape``). Names are imported at their first use, since ``app`` must be read quickly.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from slide_fmu.apps.motion.choice import MoveFamily, choose
    from slide_fmu.apps.motion.compensation import Compensated, compensate
    from slide_fmu.apps.motion.coordinates import Coordinate, coordinates_of, inputs_of
    from slide_fmu.apps.motion.costs import Answers, largest, residual, settled
    from slide_fmu.apps.motion.earliest_move import Found, earliest
    from slide_fmu.apps.motion.limits import Limits
    from slide_fmu.apps.motion.move import Move
    from slide_fmu.apps.motion.predictor import MotionError, Predictor
    from slide_fmu.apps.motion.problem import MoveProblem, Past
    from slide_fmu.apps.motion.quietest_move import quietest
    from slide_fmu.apps.motion.response import Response
    from slide_fmu.apps.motion.task import MoveTask, PathTask, read_task

_HOMES = {
    "choice": (
        "MoveFamily",
        "choose",
    ),
    "compensation": (
        "Compensated",
        "compensate",
    ),
    "coordinates": (
        "Coordinate",
        "coordinates_of",
        "inputs_of",
    ),
    "costs": (
        "Answers",
        "largest",
        "residual",
        "settled",
    ),
    "earliest_move": (
        "Found",
        "earliest",
    ),
    "limits": ("Limits",),
    "move": ("Move",),
    "problem": (
        "Past",
        "MoveProblem",
    ),
    "quietest_move": ("quietest",),
    "predictor": (
        "MotionError",
        "Predictor",
    ),
    "response": ("Response",),
    "task": (
        "MoveTask",
        "PathTask",
        "read_task",
    ),
}
"""The modules that the public names come from."""

__all__ = [
    "Answers",
    "Compensated",
    "Coordinate",
    "Found",
    "Limits",
    "MotionError",
    "Move",
    "MoveFamily",
    "MoveProblem",
    "MoveTask",
    "Past",
    "PathTask",
    "Predictor",
    "Response",
    "choose",
    "compensate",
    "coordinates_of",
    "earliest",
    "inputs_of",
    "largest",
    "quietest",
    "read_task",
    "residual",
    "settled",
]


def __getattr__(name: str) -> object:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
