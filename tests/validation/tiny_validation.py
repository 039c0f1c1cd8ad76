"""Validations of a surrogate of the tiny oscillator, beside a finer model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.accuracy_sections import validation_sections
from slide_fmu.report.html_report import ReportSection
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import Task
from slide_fmu.validation.validate import validate
from tests.figures import run_figures
from tests.progress import silent
from tests.recipes import tiny_recipe

MODEL = {"damping": 40.0, "substeps": 1}
PLAIN = tiny_recipe(system={"parameters": MODEL})
FINER = tiny_recipe(system={"parameters": MODEL, "reference": {"substeps": 24}})
TASK = Task(seed=3, trajectories=3)


def measured(fmu: Path, surrogate: Surrogate, recipe: Recipe, **more: Any) -> Validation:
    return validate(fmu, surrogate, case_of(recipe), TASK, silent, **more)


def same(one: Comparison, other: Comparison) -> bool:
    names = ("kind", "time", "inputs", "reference", "surrogate")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def figures_of(found: Validation, **more: Any) -> RunFigures:
    """What a card is written from."""
    decay = {"mean": 0.1, "worst": 0.1}
    window = {"decay_time_s": decay, "measured_decay_time_s": decay}
    known = {"validation": {"in range": found.figures()}, "window": window, "parameters": 41}
    return run_figures(**{**known, **more})


def accuracy_section(found: Validation) -> ReportSection:
    """Return the section of a report that has the table of errors."""
    sections = validation_sections({"in range": found})
    (section,) = (s for s in sections if s.title == "Side by side with the reference")
    return section
