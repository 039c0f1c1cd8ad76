"""A surrogate from a file, whether it is an FMU or a surrogate file."""

from __future__ import annotations

import zipfile
from pathlib import Path

from slide_fmu.fmu.export import FmuError, read_fmu
from slide_fmu.surrogate.payload import MAGIC
from slide_fmu.surrogate.surrogate import Surrogate


def load(path: str | Path) -> Surrogate:
    """Read the surrogate out of an FMU or of a surrogate file.

    What the file is follows from its content, not from its name. The surrogate predicts in numpy
    what the FMU answers in C.

    Args:
        path: an FMU that slide-fmu wrote (``.fmu``), or a surrogate file, as a training leaves it
            in its run folder (``surrogate.slide``).

    Returns:
        The surrogate, with its error estimator if it has one.

    Raises:
        FileNotFoundError: there is no such file.
        FmuError: the file is neither, or it is an FMU that slide-fmu did not write, or a damaged
            one.
        PayloadError: the surrogate file is damaged, or of another version.
        OSError: the file cannot be read.
    """
    if not isinstance(path, str | Path):
        raise FmuError(f"load({path!r}); expected the path of an FMU or of a surrogate file")
    if not Path(path).is_file():
        raise FileNotFoundError(
            f"{str(path)!r} is no file; expected an FMU that slide-fmu wrote (.fmu), or the "
            "surrogate.slide of a run folder: correct the path"
        )
    path = Path(path)
    with path.open("rb") as file:
        beginning = file.read(len(MAGIC))
    if beginning == MAGIC:
        return Surrogate.from_bytes(path.read_bytes())
    if zipfile.is_zipfile(path):
        return read_fmu(path)[0]
    raise FmuError(
        f"{path} begins with {beginning!r} and is neither an FMU nor a surrogate file; expected "
        "an FMU that slide-fmu wrote (.fmu), or the surrogate.slide of a run folder"
    )
