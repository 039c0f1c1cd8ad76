"""This module makes the sections of a report on variables, and on what an FMU was trained with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PureWindowsPath

from slide_fmu.core.readable import decimal
from slide_fmu.core.units import NO_UNIT, behind
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.excitation.mix import Excitation, names_of
from slide_fmu.fmu.description.surrogate_variables import Variable, fmu_variables
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.html_report import ReportSection, folded
from slide_fmu.report.table import ReportTable
from slide_fmu.surrogate.surrogate import Surrogate


def origin_sections(surrogate: Surrogate, recipe: Recipe) -> list[ReportSection]:
    """Return the folded sections on variables, equations, network and excitation."""
    equations = [ReportSection("Equations", recipe.equations.strip())] if recipe.equations else []
    return folded(
        [
            *equations,
            ReportSection("Variables", "", variable_table(surrogate)),
            ReportSection("How it was made", _made(surrogate, recipe), excitation_table(recipe)),
        ]
    )


def _made(surrogate: Surrogate, recipe: Recipe) -> str:
    window, network, data = surrogate.window, surrogate.network, recipe.data
    of_state_space, cell = "", getattr(network, "cell", None)
    if cell is not None:
        of_state_space = f" ({len(cell.a)} states, {len(cell.w)} hidden units)"
    beyond = ""
    if data.beyond:
        low, high = data.beyond_factor
        beyond = (
            f" and, with a low weight, {data.beyond} beyond the range ({low} to {high} times the "
            "amplitude)"
        )
    return (
        f"Own step {decimal(window.step, 9)} s. Window: {window.n_in} inputs, {window.n_out} "
        f"outputs. Network: {recipe.network.family}, {network.count_parameters()} "
        f"parameters{of_state_space}, trained on {data.train} trajectories of {data.duration} s"
        f"{beyond}.{_start(recipe)} {rules_of(recipe).words.inputs_seen}"
    )


def _start(recipe: Recipe) -> str:
    """Name the FMU with whose network a training began, if there was one."""
    start = getattr(recipe.training, "start", None)
    if not start:
        return ""
    return f" Its training began with the network of {PureWindowsPath(start).name}."


def excitation_table(recipe: Recipe) -> ReportTable:
    """Return the kinds of inputs that surrogate and bound have learnt from."""
    groups: tuple[tuple[str, Sequence[Excitation | LoopRecipe]], ...] = (
        ("", recipe.mix()),
        ("not measured", recipe.kinds_of_training()),
        ("bound alone", recipe.further_kinds()),
    )
    rows = [
        (
            name,
            f"{kind.weight:g}",
            "; ".join(f"{key} {value}" for key, value in kind.settings().items()),
            remark,
        )
        for remark, kinds in groups
        for name, kind in zip(names_of(kinds), kinds, strict=True)
    ]
    rows = rows or [(motion.name, "", "", "") for motion in rules_of(recipe).motions(recipe)]
    heading = "inputs", "weight", "settings", "remark"
    return ReportTable.of(heading, rows).without_empty_columns()


def variable_table(surrogate: Surrogate) -> ReportTable:
    """Return the FMU's variables in the order of their value references."""
    rows = (
        (v.name, v.causality, behind(v.unit or NO_UNIT), _range_of(v), v.description)
        for v in fmu_variables(surrogate)
    )
    return ReportTable.of(("variable", "causality", "unit", "range", ""), rows)


def _range_of(variable: Variable) -> str:
    if variable.type == "Boolean":
        return "false, true"
    if variable.low is None or variable.high is None:
        return ""
    return f"{decimal(variable.low, 4)} .. {decimal(variable.high, 4)}"
