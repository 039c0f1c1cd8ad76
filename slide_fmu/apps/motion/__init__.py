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
    from slide_fmu.apps.motion.compensation import CompensatedPath, compensate
    from slide_fmu.apps.motion.coordinates import Coordinate, coordinates_of, inputs_of
    from slide_fmu.apps.motion.costs import MoveResponses, largest, residual, settled
    from slide_fmu.apps.motion.earliest_move import OptimisedMove, earliest
    from slide_fmu.apps.motion.limits import Limits
    from slide_fmu.apps.motion.move import Move
    from slide_fmu.apps.motion.predictor import MotionError, Predictor
    from slide_fmu.apps.motion.problem import MoveProblem, ViaPoints
    from slide_fmu.apps.motion.quietest_move import quietest
    from slide_fmu.apps.motion.response import Response
    from slide_fmu.apps.motion.task import MoveTask, PathTask, read_task

_HOMES = {
    "choice": (
        "MoveFamily",
        "choose",
    ),
    "compensation": (
        "CompensatedPath",
        "compensate",
    ),
    "coordinates": (
        "Coordinate",
        "coordinates_of",
        "inputs_of",
    ),
    "costs": (
        "MoveResponses",
        "largest",
        "residual",
        "settled",
    ),
    "earliest_move": (
        "OptimisedMove",
        "earliest",
    ),
    "limits": ("Limits",),
    "move": ("Move",),
    "problem": (
        "ViaPoints",
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
    "CompensatedPath",
    "Coordinate",
    "Limits",
    "MotionError",
    "Move",
    "MoveFamily",
    "MoveProblem",
    "MoveResponses",
    "MoveTask",
    "OptimisedMove",
    "PathTask",
    "Predictor",
    "Response",
    "ViaPoints",
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
