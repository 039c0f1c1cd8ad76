"""The model description of an FMU, as fmpy reads it."""

from __future__ import annotations

from pathlib import Path

import fmpy
from fmpy.model_description import ModelDescription

from slide_fmu.fmu.export import FmuError


def read_description(path: Path, validate: bool = True) -> ModelDescription:
    """Read the model description of an FMU, whoever made it.

    Args:
        path: the FMU file.
        validate: also refuse what the standard's schema refuses.

    Raises:
        FmuError: the file is no FMU, or its model description cannot be read.
    """
    try:
        with path.open("rb") as file:  # fmpy does not close a file that it cannot read
            return fmpy.read_model_description(file, validate=validate)
    except Exception as error:  # fmpy raises bare Exception, lxml a SyntaxError, dicts a KeyError
        raise FmuError(f"{path} is not an FMU that can be read: {error}") from error
