"""An FMU is described for users: its signals, window, network, measured error and origin."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from rich.console import Console
from rich.errors import NotRenderableError

from slide_fmu.cli.console import figures_console
from slide_fmu.core.figures import read_figures
from slide_fmu.core.parameters import Parameter
from slide_fmu.core.readable import quantity
from slide_fmu.core.signals import Signal
from slide_fmu.core.units import behind
from slide_fmu.fmu.export import Provenance
from slide_fmu.network.bytes import family_of
from slide_fmu.report.console import print_noise, print_rows, print_table
from slide_fmu.report.run_figures import released_figures
from slide_fmu.report.table import ReportTable
from slide_fmu.surrogate.surrogate import Surrogate

OTHER_TYPES = (AttributeError, ArithmeticError, LookupError, TypeError, ValueError)
"""Errors that figures of other types than slide-fmu's raise."""

NOT_MEASURED = "was not measured yet: run slide-fmu validate FMU"
NOT_MEASURABLE = (
    "cannot be measured by slide-fmu: the FMU carries no recipe of a reference system. In Python, "
    "compare slide_fmu.simulate(FMU, t, u) with the outputs of your own model"
)
"""Where the error would stand: for an FMU with a recipe, and for one without."""


@dataclass(frozen=True)
class Origin:
    """An Origin is the part of an FMU's origin that users see.

    Attributes:
        recipe: the text of its recipe.
        seeds: seeds by their use.
        versions: versions of the packages that made it, by name.
    """

    recipe: str = ""
    seeds: Mapping[str, int | None] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def description(self) -> str:
        """The recipe's description of the surrogate; empty if there is none."""
        try:
            return str(tomllib.loads(self.recipe).get("description", ""))
        except tomllib.TOMLDecodeError:
            return ""


def show_description(fmu: Path, surrogate: Surrogate, provenance: Provenance) -> None:
    """Print the description of an FMU to standard output.

    Args:
        fmu: the file, for messages.
        surrogate: the surrogate of the FMU.
        provenance: its origin; empty if the FMU has none.

    Raises:
        ValueError: the origin in the FMU is not in the form that slide-fmu writes.
    """
    out = figures_console()
    try:
        origin = read_figures(Origin, provenance)
        # descriptions that init proposes begin with the name
        described = origin.description.removeprefix(f"{surrogate.name}: ")
        out.print(f"{surrogate.name}: {described}".rstrip(": "))
        measured = released_figures(provenance)
        if measured is not None:
            print_rows(measured.rows, out)
            print_noise(measured.in_range.outputs, out)
        else:
            out.print(f"Its error {NOT_MEASURED if origin.recipe else NOT_MEASURABLE}.")
        _show_signals(surrogate, out)
        _show_network(surrogate, out)
        _show_origin(origin if provenance else None, out)
    except (*OTHER_TYPES, NotRenderableError) as error:
        raise ValueError(
            f"{fmu}: resources/provenance.json is not in the form that slide-fmu "
            f"writes ({type(error).__name__}: {error}); expected recipe, seeds, versions and "
            "measured errors: slide-fmu info FMU --json - shows what is there"
        ) from error


def _show_signals(surrogate: Surrogate, out: Console) -> None:
    acts = "is held over a step" if surrogate.hold == "zero_order" else "moves between samples"
    rows = [
        *(_row("input", signal, acts) for signal in surrogate.inputs),
        *(_row("output", signal) for signal in _in_training(surrogate)),
        *(_row("parameter", parameter) for parameter in surrogate.parameters),
    ]
    print_table(ReportTable.of(("signal", "range", "acts", "meaning"), rows), out)


def _in_training(surrogate: Surrogate) -> tuple[Signal, ...]:
    """Return the outputs with the ranges that they had in the training, where these are known."""
    if surrogate.output_ranges is None:
        return surrogate.outputs
    ends = [[float(f"{end:.4g}") for end in pair] for pair in surrogate.output_ranges]
    pairs = zip(surrogate.outputs, ends, strict=True)
    return tuple(
        replace(signal, low=low, high=high, start=None) if low < high else signal
        for signal, (low, high) in pairs
    )


def _row(what: str, one: Signal | Parameter, acts: str = "") -> tuple[str, ...]:
    limits = f"{one.low:g} .. {one.high:g}{behind(one.unit)}"
    return f"{what} {one.name}", limits, acts, one.description


def _show_network(surrogate: Surrogate, out: Console) -> None:
    window, estimator, bound = surrogate.window, surrogate.estimator, surrogate.bound
    samples = f"{window.n_in} samples of the inputs and gives {window.n_out} of the outputs"
    out.print(f"window   the network sees {samples}; a sample is {window.step:.10g} s")
    also = ""
    if estimator is not None:
        also = f"; its error estimator has {estimator.network.count_parameters()}"
    family = family_of(surrogate.network).name
    out.print(f"network  {family}, {surrogate.network.count_parameters()} weights{also}")
    if bound is not None:
        *others, last = (f"{100 * confidence:g} %" for confidence in bound.confidences)
        confidences = f"{', '.join(others)} or {last}" if others else last
        out.print(
            f"bound    of the error, with a confidence of {confidences}{_trusted(surrogate)}"
        )
        if bound.span is not None:
            span = bound.span.samples * window.step
            out.print(f"estimate of the error over {span:g} s, by the networks of the bound")


def _trusted(surrogate: Surrogate) -> str:
    """Say up to which bounds steps are trusted, unless the importer sets other tolerances."""
    bound, scales = surrogate.bound, surrogate.output_scaling.scale
    if bound is None:
        return ""
    most = (
        f"{quantity(float(tolerance), one.unit)} of {one.name}"
        for one, tolerance in zip(surrogate.outputs, bound.tolerances * scales, strict=True)
    )
    return f"; at the start, tolerances are {', '.join(most)}"


def _show_origin(origin: Origin | None, out: Console) -> None:
    if origin is None:
        out.print("origin   not known: the FMU has no provenance")
        return
    known = {key: seed for key, seed in origin.seeds.items() if seed is not None}
    seeds = ", ".join(f"{key} {value}" for key, value in known.items())
    versions = ", ".join(f"{key} {value}" for key, value in origin.versions.items())
    lines = len(origin.recipe.splitlines())
    out.print(f"seeds    {seeds}")
    out.print(f"made by  {versions}")
    out.print(f"recipe   {lines} lines; slide-fmu info FMU --json - shows them, and all figures")
