"""The page of an FMU is one HTML file that needs no other file and no internet connection."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import jinja2

from slide_fmu.apps.page.drawing import Drawing, checked_drawing, load_drawing
from slide_fmu.apps.page.facts import PageFacts, names_of, page_facts
from slide_fmu.core.figures import plain, spread
from slide_fmu.core.files import write_whole
from slide_fmu.core.web.packing import packed, scripts, styles
from slide_fmu.fmu.export import Provenance, read_fmu
from slide_fmu.fmu.libraries.build import PAGE_LIBRARY
from slide_fmu.fmu.libraries.platforms import compiled
from slide_fmu.pipeline.apps import example_run
from slide_fmu.surrogate.surrogate import Surrogate

WEB = Path(__file__).parent / "web"

Look = Literal["page", "front"]


@dataclass(frozen=True)
class ExampleRun:
    """An ExampleRun has the physical parameters of a run that an FMU carries."""

    parameters: Mapping[str, float]


@dataclass(frozen=True)
class PageContent:
    """PageContent is the content of a page.

    Attributes:
        title: heading.
        surrogate: the surrogate that runs in it.
        trajectory: the run that the FMU carries; None without one.
        drawn: whether the machine is drawn in motion.
        moves: two moves from another app, in plain values; None without any.
    """

    title: str
    surrogate: PageFacts = spread()
    trajectory: ExampleRun | None = None
    drawn: bool = False
    moves: Mapping[str, Any] | None = None


def write_page(
    fmu: Path,
    path: Path,
    title: str | None = None,
    drawing: str | None = None,
    moves: Mapping[str, Any] | None = None,
) -> Path:
    """Write the page of an FMU, with the trajectory that it carries, and return its path.

    Args:
        fmu: an FMU that slide-fmu wrote.
        path: the HTML file; replaced as a whole when it is there.
        title: heading; the name of the surrogate if None.
        drawing: ``"package.module:function"`` that describes the machine's drawing
            (``slide_fmu/apps/page/drawing.py``); if None, the description that the FMU carries, if
            any.
        moves: two moves that it plays next to each other, from
            ``slide_fmu.pipeline.apps.moves_of_task``; physical parameters then start at the moves'
            values. No moves if None.

    Raises:
        DrawingError: the drawing is not usable.
        LoadError: the module of the drawing cannot be imported.
        CredentialError: the experiment that the FMU carries is damaged.
        FileNotFoundError: the runtime has not been compiled.
        FmuError: the file is not an FMU of slide-fmu, or damaged.
        OSError: a file cannot be read or written.
        ValueError: the path does not end in ``.html``.
    """
    _require_html(path)
    write_whole(path, page_of(fmu, title, drawing, moves).encode("utf-8"))
    return path


def page_of(
    fmu: Path,
    title: str | None = None,
    drawing: str | None = None,
    moves: Mapping[str, Any] | None = None,
    look: Look = "page",
) -> str:
    """Return the page of an FMU as text; arguments and errors are as for ``write_page``.

    With the look "front" it is made for embedding in another page, with the machine in front.
    """
    surrogate, provenance = read_fmu(fmu)
    run = example_run(fmu)
    files: dict[str, bytes] = {}
    facts, trajectory = page_facts(surrogate, provenance), None
    if drawing is None:
        described = carried_drawing(surrogate, provenance)
    else:
        described = load_drawing(drawing, names_of(surrogate))
    if moves is not None:  # their sliders begin where the moves were chosen
        facts = _beginning_at(facts, moves["parameters"])
    if run is not None:
        parameters, files = run
        trajectory = ExampleRun(parameters)
    if described is not None:
        files["drawing"] = json.dumps(described.plain()).encode("utf-8")
    drawn = described is not None
    content = PageContent(title or surrogate.name, facts, trajectory, drawn, moves)
    return page_html(surrogate, content, files, look)


def write_drop_page(path: Path, title: str | None = None) -> Path:
    """Write the page on which users drop their own FMUs, and return its path.

    Raises:
        FileNotFoundError: the runtime has not been compiled.
        OSError: the file cannot be written.
        ValueError: the path does not end in ``.html``.
    """
    _require_html(path)
    write_whole(path, drop_page(title).encode("utf-8"))
    return path


def drop_page(title: str | None = None) -> str:
    """Return the page on which users drop their own FMUs, as text."""
    about = "Try a surrogate in your browser: no server, no installation."
    given = {"title": title or "Drop your FMU", "name": "", "summary": about, "columns": ""}
    return _rendered("page", None, given, {"runtime": compiled(PAGE_LIBRARY)})


def _require_html(path: Path) -> None:
    if path.suffix != ".html":
        raise ValueError(f"page {str(path)!r}; expected a name ending in .html")


def _beginning_at(facts: PageFacts, values: Mapping[str, float]) -> PageFacts:
    """Return the facts of a page with other start values of physical parameters."""
    parameters = tuple(
        replace(parameter, start=values.get(parameter.name, parameter.start))
        for parameter in facts.parameters
    )
    return replace(facts, parameters=parameters)


def carried_drawing(surrogate: Surrogate, provenance: Provenance | None) -> Drawing | None:
    """Return the drawing that an FMU carries in its provenance; None if there is none.

    Raises:
        DrawingError: it is not usable.
    """
    carried = (provenance or {}).get("drawing")
    if carried is None:
        return None
    return checked_drawing(carried, names_of(surrogate), f"in the provenance of {surrogate.name}")


def page_html(
    surrogate: Surrogate, content: PageContent, files: dict[str, bytes], look: Look
) -> str:
    """Return the page; the same arguments give the same text.

    Args:
        surrogate: the surrogate that runs in it.
        content: its content.
        files: further files that it reads, by their names in the page.
        look: its layout.
    """
    shown = content.surrogate
    given = {
        "title": content.title,
        "name": shown.name,
        "summary": _summary(shown),
        "columns": ", ".join(signal.name for signal in shown.inputs),
    }
    blobs = {"runtime": compiled(PAGE_LIBRARY), "surrogate": surrogate.to_bytes(), **files}
    return _rendered(look, plain(content), given, blobs)


def _rendered(look: Look, facts: Any, given: Mapping[str, str], blobs: Mapping[str, bytes]) -> str:
    """Return the page with facts in plain values, texts for people, and files by their names."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(WEB), autoescape=True, undefined=jinja2.StrictUndefined
    )
    return environment.get_template("page.html").render(
        look=look,
        json=json.dumps(facts, separators=(",", ":")).replace(
            "<", "\\u003c"
        ),  # so that no text ends the element
        blobs={name: packed(content) for name, content in blobs.items()},
        style=styles(WEB / "style.css"),
        **given,
        **scripts(WEB / "main.js"),
    )


def _summary(facts: PageFacts) -> str:
    """Describe the surrogate in one line."""
    inputs, outputs = len(facts.inputs), len(facts.outputs)
    return (
        f"surrogate {facts.name}: {inputs} input{'s' * (inputs > 1)}, {outputs} "
        f"output{'s' * (outputs > 1)}, a step of {facts.step:.4g} s. Outputs depend on the inputs "
        f"of the last {facts.memory:.3g} s."
    )
