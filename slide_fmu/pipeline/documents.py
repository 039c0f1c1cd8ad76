"""This module writes an FMU with report, model card and documents of apps."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.core.version import WRITTEN_BY, __version__
from slide_fmu.fmu.export import DOCUMENTATION, EXTRA, export_fmu
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.fmu.libraries.sources import Sources
from slide_fmu.pipeline.apps import Release, all_members

PAGE = f"{DOCUMENTATION}/index.html"
CARD = f"{DOCUMENTATION}/model_card.md"


def documents(page: bytes, card: str) -> dict[str, bytes]:
    """Return a report (HTML) and a model card (Markdown) by their names in an FMU.

    Neither has times, which are others in each run; the card has no pictures, which are files.
    """
    return {PAGE: page, CARD: card.encode("utf-8")}


def write_release(
    release: Release, path: Path, fmi: FmiVersion = 2, sources: Sources = False
) -> Path:
    """Write an FMU with its documents and files of apps, and return its path.

    The provenance in it names this version of slide-fmu, whose words these files have.
    The version of FMI, C sources and errors are as in ``slide_fmu.fmu.export.export_fmu``.
    """
    members = all_members(release)
    folders = {
        folder: {
            name.removeprefix(f"{folder}/"): content
            for name, content in members.items()
            if name.startswith(f"{folder}/")
        }
        for folder in (DOCUMENTATION, EXTRA)
    }
    return export_fmu(
        release.surrogate,
        path,
        fmi=fmi,
        sources=sources,
        provenance={**release.provenance, WRITTEN_BY: __version__},
        documentation=folders[DOCUMENTATION],
        extra=folders[EXTRA],
    )
