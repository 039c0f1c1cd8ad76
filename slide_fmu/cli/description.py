"""What an FMU is, for people: its signals, window, network, measured error and origin."""

from __future__ import annotations

import sys
import tomllib
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.errors import NotRenderableError

from slide_fmu.core.figures import JsonObject
from slide_fmu.core.units import behind
from slide_fmu.pipeline.display import Messages
from slide_fmu.report.console import print_table, print_validation
from slide_fmu.report.run_figures import RunFigures, released_figures
from slide_fmu.report.table import Table
from slide_fmu.report.verdict import Subject, verdict

OTHER_TYPES = (AttributeError, ArithmeticError, LookupError, TypeError, ValueError)
"""What is raised where figures have other types than slide-fmu writes."""


def show_description(fmu: Path, figures: JsonObject) -> None:
    """Print what ``slide_fmu.pipeline.info.describe_fmu`` has found, to standard output.

    Args:
        fmu: the file, for messages.
        figures: what was found.

    Raises:
        ValueError: what the FMU says about its origin is none that slide-fmu writes.
    """
    out = Messages(file=sys.stdout, markup=False, highlight=False)
    try:
        origin = figures["provenance"] or {}
        out.print(f"{figures['name']}: {_description(origin)}".rstrip(": "))
        measured = released_figures(origin)
        for sentence in _verdict(figures, measured):
            out.print(sentence)
        _show_signals(figures, out)
        _show_network(figures, out)
        _show_error(measured, out)
        _show_origin(origin, out)
    except (*OTHER_TYPES, NotRenderableError) as error:
        raise ValueError(
            f"{fmu}: resources/provenance.json says something else than slide-fmu "
            f"writes ({type(error).__name__}: {error}); expected recipe, seeds, versions and "
            "measured errors: slide-fmu info FMU --json - shows what is there"
        ) from error


def _verdict(figures: JsonObject, measured: RunFigures | None) -> tuple[str, ...]:
    """Return what a user must know of an FMU, by what was measured when it was made."""
    inputs = tuple((s["name"], s["low"], s["high"], s["unit"]) for s in figures["inputs"])
    memory, step = figures["memory_s"], figures["window"]["step"]
    return verdict(measured, Subject(inputs, memory, step, figures["planned"]))


def _description(origin: JsonObject) -> str:
    """Return the line that the recipe says about the surrogate; empty where there is none."""
    try:
        return str(tomllib.loads(origin.get("recipe", "")).get("description", ""))
    except tomllib.TOMLDecodeError:
        return ""


def _show_signals(figures: JsonObject, out: Console) -> None:
    acts = "is held over a step" if figures["hold"] == "zero_order" else "moves between samples"
    rows = []
    for what in ("inputs", "outputs"):
        for signal in figures[what]:
            limits = f"{signal['low']:g} .. {signal['high']:g}{behind(signal['unit'])}"
            row = (f"{what[:-1]} {signal['name']}", limits, acts if what == "inputs" else "")
            rows.append((*row, signal["description"]))
    for parameter in figures.get("physical_parameters", ()):
        limits = f"{parameter['low']:g} .. {parameter['high']:g}{behind(parameter['unit'])}"
        rows.append((f"parameter {parameter['name']}", limits, "", parameter["description"]))
    print_table(Table.of(("signal", "range", "acts", "meaning"), rows), out)


def _show_network(figures: JsonObject, out: Console) -> None:
    window, estimator = figures["window"], figures["estimator_parameters"]
    samples = f"{window['n_in']} inputs to {window['n_out']} outputs"
    out.print(f"window   {samples}, {window['step']:g} s apart")
    told = "" if estimator is None else f"; its error estimator has {estimator}"
    out.print(f"network  {figures['parameters']} weights{told}")
    if "error_bound" in figures:
        bound = figures["error_bound"]
        confidences = ", ".join(f"{confidence:g}" for confidence in bound["confidences"])
        out.print(f"bound    of the error, for the confidences {confidences}")
        if "estimate_span_s" in bound:
            out.print(f"estimate of the error over {bound['estimate_span_s']:g} s, by the same")


def _show_error(measured: RunFigures | None, out: Console) -> None:
    """Print the error that was measured when the FMU was made."""
    if measured is None:
        out.print("error    nobody has measured it: slide-fmu validate FMU does")
        return
    for index, (name, validation) in enumerate(measured.ordered.items()):
        if index:  # what bounds are worth in range is enough here
            validation = replace(validation, error_bound=None)
        print_validation(validation, f"error {name}", out)


def _show_origin(origin: JsonObject, out: Console) -> None:
    if not origin:
        out.print("origin   it does not say where it comes from")
        return
    known = {key: seed for key, seed in origin.get("seeds", {}).items() if seed is not None}
    seeds = ", ".join(f"{key} {value}" for key, value in known.items())
    versions = ", ".join(f"{key} {value}" for key, value in origin.get("versions", {}).items())
    lines = len(str(origin.get("recipe", "")).splitlines())
    out.print(f"seeds    {seeds}")
    out.print(f"made by  {versions}")
    out.print(f"recipe   {lines} lines; slide-fmu info FMU --json - shows them, and all figures")
