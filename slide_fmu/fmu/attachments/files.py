"""Read the files that every FMU of slide-fmu carries in addition to model and libraries."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.fmu.libraries.platforms import FmiVersion

FOLDER = Path(__file__).parent
LICENSES = "documentation/licenses"
"""Folder that both standards prescribe, with ``license.txt`` as its first page."""

ICON: dict[FmiVersion, str] = {2: "model.png", 3: "terminalsAndIcons/icon.png"}


def attached_files(fmi: FmiVersion) -> dict[str, bytes]:
    """Return licences and icon, by their names in an FMU of a version of the standard."""
    texts = sorted((FOLDER / "licenses").glob("*.txt"))
    licenses = {f"{LICENSES}/{path.name}": path.read_bytes() for path in texts}
    return {**licenses, ICON[fmi]: (FOLDER / "icon.png").read_bytes()}
