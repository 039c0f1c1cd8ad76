"""An FMU is unpacked into a folder; errors of its archive and of the disk are distinguished."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.core.extras import require_running
from slide_fmu.core.files import FullDiskError, filling


class UnpackingError(ValueError):
    """An FMU cannot be unpacked: the archive is damaged, or would write outside the folder."""


def unpack(fmu: Path, folder: str) -> None:
    """Unpack an FMU into a folder.

    Raises:
        FullDiskError: there is no space for its files.
        UnpackingError: it cannot be unpacked.
        ModuleNotFoundError: fmpy is not installed; the message has the remedy.
    """
    require_running()
    import fmpy

    try:
        with filling(Path(folder)):
            fmpy.extract(str(fmu), folder)
    except FullDiskError:
        raise
    except Exception as error:  # fmpy raises bare Exception for paths outside of the folder
        raise UnpackingError(str(error)) from error
