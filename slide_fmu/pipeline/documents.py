"""This module writes an FMU with report, model card and documents of apps."""

from __future__ import annotations

import re
from pathlib import Path

from slide_fmu.fmu.export import DOCUMENTATION, EXTRA, Provenance, export_fmu
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.fmu.libraries.sources import Sources
from slide_fmu.pipeline.apps import Release, all_members
from slide_fmu.report.html_report import own_version
from slide_fmu.report.model_card import without_pictures

WRITTEN_BY = "written_by"
"""Key of the provenance: the version that wrote the documents and the files of apps. It is another
than the version of the training where a released FMU was built again."""

A_VERSION = re.compile(r"[\w.+-]{1,40}")

PAGE = f"{DOCUMENTATION}/index.html"
CARD = f"{DOCUMENTATION}/model_card.md"


def documents(page: bytes, card: str) -> dict[str, bytes]:
    """Return a report (HTML) and a model card (Markdown) by their names in an FMU."""
    return {PAGE: page, CARD: without_pictures(card).encode("utf-8")}


def write_release(
    release: Release, path: Path, fmi: FmiVersion = 2, sources: Sources = False
) -> Path:
    """Write an FMU with its documents and files of apps, and return its path.

    The provenance in it names this version of slide-fmu, whose words these files have.
    The version of FMI, C sources and errors are as in ``slide_fmu.fmu.export.export_fmu``.
    """
    found = all_members(release)
    folders = {
        folder: {
            name.removeprefix(f"{folder}/"): content
            for name, content in found.items()
            if name.startswith(f"{folder}/")
        }
        for folder in (DOCUMENTATION, EXTRA)
    }
    return export_fmu(
        release.surrogate,
        path,
        fmi=fmi,
        sources=sources,
        provenance={**release.provenance, WRITTEN_BY: own_version()},
        documentation=folders[DOCUMENTATION],
        extra=folders[EXTRA],
    )


def other_writer(provenance: Provenance | None) -> str | None:
    """Return the version that wrote the documents of an FMU, if it is another than this one.

    None also if the provenance names no version, so that nothing is left out for that.
    """
    found = (provenance or {}).get(WRITTEN_BY)
    if not isinstance(found, str) or not A_VERSION.fullmatch(found):
        return None
    return None if found == own_version() else found
