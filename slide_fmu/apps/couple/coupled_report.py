"""The report of a coupled run shows what the components exchanged, and what that took."""

from __future__ import annotations

from collections.abc import Sequence

from slide_fmu.apps.couple.options import IMPLICIT
from slide_fmu.apps.couple.result import CoupledRun
from slide_fmu.apps.couple.structure import CoupledSystem
from slide_fmu.core.readable import duration, number
from slide_fmu.core.units import NO_UNIT
from slide_fmu.core.web.charts import Chart, Line, Panel, colour_of
from slide_fmu.report.html_report import Fact, Report, ReportSection, Verdict, remark_sections
from slide_fmu.report.table import ReportTable

TITLES = {
    "jacobi": "explicit Jacobi",
    "gauss_seidel": "explicit Gauss-Seidel",
    "fixed_point": "implicit, by a fixed point",
    "newton": "implicit, by Newton's method",
}
"""The methods in words."""

INPUTS = {
    "held": "held over each step",
    "reached": "move to the set value by the end of a step",
    "sloped": "move with a slope that is set",
    "forecast": "go on as the FMU forecasts",
}
"""What inputs of a component do within a step, in words."""

MOST_POINTS = 4000
"""A line is drawn with about this number of points at most."""


def coupled_table(result: CoupledRun) -> ReportTable:
    """Return a table of the components: their inputs, and the steps that they took."""
    figures = result.figures
    rows = (
        (name, INPUTS[figures.inputs[name]], number(steps), number(steps / figures.steps))
        for name, steps in figures.component_steps.items()
    )
    heading = "component", "its inputs", "steps of the FMU", "for each step"
    return ReportTable.of(heading, rows, f"{TITLES[figures.method]}, {_steps(result)}")


def _steps(result: CoupledRun) -> str:
    """Say how long the steps are."""
    figures = result.figures
    if figures.shortest_step_s < 0.999 * figures.step_s:
        return (
            f"{number(figures.steps)} steps of {duration(figures.shortest_step_s)} to "
            f"{duration(figures.step_s)}"
        )
    return f"{number(figures.steps)} steps of {duration(figures.step_s)}"


def coupled_report(name: str, result: CoupledRun, system: CoupledSystem) -> Report:
    """Return the report of a run."""
    figures = result.figures
    summary = (
        f"{len(system.paths)} FMUs with {len(system.links)} connections ran together for "
        f"{result.time[-1]:g} s: {TITLES[figures.method]}, {_steps(result)}."
    )
    facts = [
        Fact("Simulated", f"{result.time[-1]:g} s", f"It took {duration(figures.seconds)}."),
        Fact("Step", duration(figures.step_s), f"There were {number(figures.steps)} steps."),
    ]
    if figures.method in IMPLICIT:
        text = f"Mean of a step; the largest number is {figures.most_iterations}."
        facts.append(Fact("Iterations", f"{figures.iterations:.3g}", text))
    if figures.rejected:
        text = "These steps had too large an error, and were taken again with half the length."
        facts.append(Fact("Repeated", number(figures.rejected), text))
    links = ReportTable.of(
        ("from", "to", "unit"),
        (
            (str(link.source), str(link.target), result.units.get(str(link.target), ""))
            for link in system.links
        ),
    ).without_empty_columns()
    targets = {str(link.target) for link in system.links}
    linked = [one for one in result.values if one in targets]
    others = [one for one in result.values if one not in targets]
    sections = [
        *remark_sections(figures.remarks),
        ReportSection(
            "Connections",
            "Each input follows the output that it is connected to.",
            links,
            charts=[_chart("Linked inputs", result, linked)] if linked else [],
        ),
        ReportSection(
            "Outputs and other inputs",
            "These are the values at the communication points.",
            charts=[_chart("Over time", result, others)] if others else [],
        ),
        ReportSection(
            "Components", "Repeated steps and shorter steps count too.", coupled_table(result)
        ),
    ]
    return Report(f"Coupled: {name}", summary, figures, sections, verdict=Verdict(facts=facts))


def _chart(title: str, result: CoupledRun, names: Sequence[str]) -> Chart:
    """Draw values over time, with one panel for each unit."""
    every = max(1, len(result.time) // MOST_POINTS)
    panels = []
    groups = dict.fromkeys(result.units[name] or name for name in names)  # no unit: a panel each
    for group in groups:
        together = [name for name in names if (result.units[name] or name) == group]
        alone = len(together) == 1  # the panel then has its name
        lines = [
            Line(
                "" if alone else name,
                result.time[::every],
                result.values[name][::every],
                colour_of(i),
                width=1.2,
            )
            for i, name in enumerate(together)
        ]
        unit = result.units[together[0]] or NO_UNIT
        panels.append(Panel(together[0] if alone else "values", unit, lines, height="short"))
    return Chart(title, panels)
