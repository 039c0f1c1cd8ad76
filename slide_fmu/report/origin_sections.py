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
from slide_fmu.report.prose import sentences
from slide_fmu.report.table import ReportTable
from slide_fmu.surrogate.description import SurrogateDescription
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
    """Say what was trained on what, and with which network a training began, if with one."""
    start = getattr(recipe.training, "start", None)
    return " ".join(
        sentences(
            "made.txt",
            surrogate=SurrogateDescription.of(surrogate),
            data=recipe.data,
            start=PureWindowsPath(start).name if start else None,
            inputs_seen=rules_of(recipe).words.inputs_seen,
        )
    )


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
