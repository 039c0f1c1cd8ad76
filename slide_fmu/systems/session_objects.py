"""Reference systems of the kind "object": a Python session gives them itself.

Recipes hold plain values, so a recipe can name such an object, but not hold it. The object
is a part of the specification, and is sent to worker processes as a pickle.
"""

from __future__ import annotations

from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.specification import Specification


def make(specification: Specification) -> System:
    """Return the object that is given: itself, and no copy.

    Raises:
        LoadError: no object is given, or the recipe repeats its own declarations.
    """
    name, system = specification.model, specification.given
    if system is None:
        raise LoadError(
            f"system {name!r} is an object of the Python session that learnt it (slide.learn), "
            "and is not here; expected the object again (slide.validate(..., system=...)), or a "
            'model that every process can make, in a file (system.kind = "function" or "class")'
        )
    if specification.parameters or specification.inputs or specification.outputs:
        raise LoadError(
            f"system {name!r}: parameters, inputs or outputs of the recipe; expected none, since "
            "an object has its own: remove them"
        )
    if specification.part_of > 1:
        raise LoadError(
            f"system {name!r} is an object with the step {system.step} s; expected a model of "
            f"which a finer one can be made for data.substeps = {specification.part_of}: set "
            "data.substeps = 1, or give the model in a file"
        )
    if specification.step not in (None, system.step):
        raise LoadError(
            f"system {name!r} has the step {system.step} s; expected the same window.step, not "
            f"{specification.step}: remove it"
        )
    return system
