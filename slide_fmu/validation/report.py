"""The report of a surrogate has its figures as JSON, pictures and tables as one HTML file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from slide_fmu.memory.decay_figures import decay_rows
from slide_fmu.memory.sizing import AnySizing, Sizing
from slide_fmu.memory.stability import AmplitudeTest
from slide_fmu.recipe.measured import KIND
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.validation import figures
from slide_fmu.validation.comparison import Validation, meaning_of
from slide_fmu.validation.pictures import in_page
from slide_fmu.validation.response import exact_matrix, learnt_matrix, matrix_figures
from slide_fmu.validation.tables import curve_rows, parameter_rows, size_rows

OF_RECORDS = "relative_noise_floor", "free_relative_rmse"
"""Figures of outputs that were measured: the noise, and the error of the network run freely."""

MODEL_TEXT = (
    " The reference is a finer model than the one that made the data; what that one errs on the "
    "same inputs stands beside the surrogate's error."
)


def moving_text(surrogate: Surrogate) -> str:
    """Say what is set before a step, of inputs with a first-order hold; nothing of others."""
    if surrogate.hold == "zero_order":
        return ""
    return (
        " Both FMUs are told what the inputs reach by each step's end. An importer that sets what "
        "they are at its begin, which is all that a plain simulation does, has the errors of the "
        f'column "inputs set to what they are now": {meaning_of(surrogate)}.'
    )


@dataclass(frozen=True, eq=False)
class Section:
    """A section is one part of a report.

    Attributes:
        title: heading.
        text: what is seen here and how to read it.
        rows: table, whose first row is the heading; it may be empty.
        pictures: PNG bytes.
    """

    title: str
    text: str
    rows: Sequence[Sequence[str]] = ()
    pictures: Sequence[bytes] = ()


@dataclass(frozen=True, eq=False)
class Report:
    """A report says what the FMU is, with its figures, and the sections that show them."""

    title: str
    summary: str
    data: dict[str, Any]
    sections: list[Section] = field(default_factory=list)

    def html(self) -> str:
        """Return the whole report as one self-contained page."""
        environment = jinja2.Environment(
            loader=jinja2.PackageLoader("slide_fmu.validation"), autoescape=True, trim_blocks=True
        )
        pictures = [
            [in_page(picture) for picture in section.pictures] for section in self.sections
        ]
        template = environment.get_template("report.html")
        return template.render(report=self, sections=zip(self.sections, pictures, strict=True))

    def write(self, folder: Path) -> Path:
        """Write ``report.html`` and ``report.json``, and return the path of the page."""
        folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps(self.data, indent=2)
        (folder / "report.json").write_text(text + "\n", encoding="utf-8")
        path = folder / "report.html"
        path.write_text(self.html(), encoding="utf-8")
        return path


def validation_sections(validations: Mapping[str, Validation]) -> list[Section]:
    """Return the sections on the accuracy; the first validation is the one in range."""
    main = next(iter(validations.values()))
    pictures = [figures.side_by_side(main, index) for index in range(len(main.surrogate.outputs))]
    sections = [
        Section(
            "Side by side with the reference",
            _compared(main)
            + (MODEL_TEXT if main.recipe.system.reference else "")
            + moving_text(main.surrogate),
            _accuracy_rows(validations),
            pictures,
        ),
        Section(
            "By file" if main.recipe.system.kind == KIND else "By kind of excitation",
            "Relative RMSE: RMSE of the FMU over the RMS of the reference.",
            (),
            [figures.excitation_bars(main)],
        ),
    ]
    if main.surrogate.parameters:
        text = (
            "Every trajectory has values of the physical parameters that no training saw; one "
            "more is at each corner of their ranges, which the figures above do not count. "
            "Relative RMSE is the largest of the outputs."
        )
        rows = parameter_rows(main.figures()["parameters"])
        sections.append(Section("Physical parameters", text, rows))
    if main.surrogate.estimator is not None:
        sections.append(_estimate_section(validations))
    sections.append(_timing_section(main))
    return sections


def _compared(validation: Validation) -> str:
    """Say what was compared with what."""
    count = len(validation.comparisons)
    if validation.recipe.system.kind == KIND:
        return (
            f"{count} blocks of the records that nothing was learnt or chosen from, and the FMU "
            "run on their inputs. What was measured has noise of its own, which no surrogate can "
            "predict: its RMS is estimated from the flat bottom of the residuals' spectrum. Run "
            "freely, never handed over from window to window, the network begins with the state "
            "that the lead of a block shows."
        )
    return (
        f"{count} trajectories that no training saw (seed {validation.task.seed}), the FMU and "
        "the reference FMU run by the same importer."
    )


EIGENVALUES = (
    "from the eigenvalues of the equations linearized along motions, by their mean rate over "
    "stretches of the motions, and measured as the time in which two motions under the same "
    "input meet. At an instant on the way the slowest mode may decay more slowly, or grow "
    "(without end): what counts is the mean."
)
MEASURED_ALONE = (
    "measured as the time in which two motions under the same input meet. The system does not "
    "offer its linearized equations, so the mean rate of the pairs of motions decides."
)
"""How decay times were found, as the report says it."""


FITTED = (
    "from the slowest pole of a linear model that was fitted to the records, with the 95 % "
    "interval of that fit. How long the fitted network itself remembers is tested below."
)


def sizing_section(sizing: AnySizing) -> Section:
    """Show how long the system remembers its initial state, and what the window truncates."""
    window = sizing.window
    found = MEASURED_ALONE
    if not isinstance(sizing, Sizing):
        found = FITTED
    elif sizing.linearized:
        found = EIGENVALUES
    text = (
        f"Time until initial effects have decayed to {sizing.remaining_amplitude:g} of their "
        f"amplitude: {found} The window truncates "
        f"{window.n_in} - {window.n_out} samples, {window.truncation_time:.4g} s."
    )
    if sizing.remark is not None:
        text += f" Remark: {sizing.remark}."
    if not isinstance(sizing, Sizing):
        return Section("Window", text, decay_rows(sizing.figures()))
    linearized = None if sizing.linearized is None else sizing.linearized.decay
    picture = figures.decay_times(linearized, sizing.measured, window.truncation_time)
    return Section("Window", text, decay_rows(sizing.figures()), [picture])


def stability_section(tests: Sequence[AmplitudeTest], step: float) -> Section:
    """Show whether the network has fading memory and stays bounded beyond its amplitude."""
    rows = [("amplitude", "median difference", "largest difference", "growth", "test")]
    for test in tests:
        gaps = float(np.median(test.differences)), float(np.max(test.differences))
        verdict = "passed" if test.problem is None else test.problem
        rows.append(
            (f"{test.amplitude:g} x", _e(gaps[0]), _e(gaps[1]), f"{test.growth:.3g}", verdict)
        )
    return Section(
        "Fading memory and boundedness",
        "Two runs from different states under the same inputs, after one window, relative to the "
        "output's standard deviation; and the largest output, relative to that at the trained "
        "amplitude times the factor (growth). Beyond the trained amplitude systems may have "
        "several lasting responses: there the median pair counts.",
        rows,
        [figures.stability_tests(tests, step)],
    )


def training_section(histories: Mapping[str, Mapping[str, Sequence[float]]]) -> Section:
    """Show how the trainings went."""
    rows = [("stage", "steps or iterations", "best validation error, scaled")]
    for stage, history in histories.items():
        best = min(history["validation_error"])
        rows.append((stage, str(history["step"][-1]), f"{best:.4g}"))
    return Section(
        "Training",
        "The weights of the best validation are kept. Errors are RMSE in scaled units; of the "
        "estimator at single samples, where it learns by likelihood, a mean standard deviation, "
        "and then the mean deviation of its scaled logarithm.",
        rows,
        [figures.training_history(histories)],
    )


def remark_sections(remarks: Sequence[str]) -> list[Section]:
    """Show remarks in a section of their own, if there are any."""
    if not remarks:
        return []
    return [
        Section("Remarks", " ".join(f"{remark[0].upper()}{remark[1:]}." for remark in remarks))
    ]


def sizes_section(sizes: Sequence[Mapping[str, Any]], remark: str | None) -> Section:
    """Show which sizes of the network were tried, and what remains to be learnt."""
    text = (
        "Validation errors are RMSE in scaled units, after the short runs by which a size is "
        "judged; the chosen one is trained longer. What is learnable could be predicted from the "
        "inputs by a regression on the residual; no figure: the search did not ask."
    )
    text += "" if remark is None else f" Remark: {remark}."
    return Section("Sizes tried", text, size_rows(sizes))


def curve_section(curve: Mapping[str, Any]) -> Section:
    """Show how the error fell with the number of trajectories."""
    points = curve["points"]
    return Section(
        "Learning curve",
        "Validation error of a network of moderate size, scaled, that learns from twice as many "
        f"trajectories at each point. The curve ended: {curve['ended']}.",
        curve_rows(curve),
        [
            figures.learning_curve(
                [point["trajectories"] for point in points],
                [point["validation_error"] for point in points],
            )
        ],
    )


def response_section(surrogate: Surrogate, system: System) -> tuple[Section, dict[str, Any]]:
    """The learnt response matrix of an affine surrogate against the exact one."""
    learnt, exact = learnt_matrix(surrogate), exact_matrix(system, surrogate.window)
    data = matrix_figures(learnt, exact)
    rows = [
        ("figure", "value"),
        ("largest deviation, relative to the largest entry", _e(data["max_deviation_relative"])),
        ("largest entry above the diagonal, absolute", _e(data["max_above_diagonal"])),
        ("the same, relative to the largest entry", _e(data["max_above_diagonal_relative"])),
    ]
    text = (
        "Every row is one output sample of the window, every column one input sample. Entries "
        "above the diagonal would mean that an output answers to a later input."
    )
    return Section("Response matrix", text, rows, [figures.response_matrices(learnt, exact)]), data


def _accuracy_rows(validations: Mapping[str, Validation]) -> list[Sequence[str]]:
    with_model = any(validation.recipe.system.reference for validation in validations.values())
    moving = any(v.surrogate.hold == "first_order" for v in validations.values())
    measured = any(v.recipe.system.kind == KIND for v in validations.values())
    rows: list[Sequence[str]] = [
        (
            "inputs",
            "output",
            "RMS of the reference",
            "RMSE",
            "relative RMSE",
            "median of trajectories (10 % .. 90 %)",
            "largest error",
            *(["relative RMSE, inputs set to what they are now"] if moving else []),
            *(["relative RMSE of the data's model"] if with_model else []),
            *(["noise of what was measured", "run freely"] if measured else []),
        )
    ]
    for name, validation in validations.items():
        for output in validation.figures()["outputs"]:
            unit, single = output["unit"], output["relative_rmse_of_trajectories"]
            rows.append(
                (
                    name,
                    output["name"],
                    f"{output['rms_reference']:.4g} {unit}",
                    f"{output['rmse']:.4g} {unit}",
                    _percent(output["relative_rmse"]),
                    f"{_percent(single['median'])} ({_percent(single['p10'])} .. "
                    f"{_percent(single['p90'])})",
                    f"{output['max_error']:.4g} {unit}",
                    *([_percent(output["plain_relative_rmse"])] if moving else []),
                    *([_percent(output["model_relative_rmse"])] if with_model else []),
                    *([_known(output, key) for key in OF_RECORDS] if measured else []),
                )
            )
    return rows


def _estimate_section(validations: Mapping[str, Validation]) -> Section:
    rows: list[Sequence[str]] = [("inputs", "mean relative deviation", "95 % are within")]
    for name, validation in validations.items():
        data = validation.figures()["error_estimate"]
        parts = {name: data}
        if "euclidean" in data:
            parts[f"{name}, norm of the outputs"] = data["euclidean"]
        keys = ("mean_relative_deviation", "p95_relative_deviation")
        rows += [(part, *(_percent(found[key]) for key in keys)) for part, found in parts.items()]
    first = next(iter(validations.values()))
    assert first.recipe.estimator is not None
    text = (
        "The FMU estimates the RMSE of its outputs over the last "
        f"{first.surrogate.estimated_samples} samples. Here it is compared with the true "
        "error; the band holds deviations up to 37.5 %. Errors below "
        f"{first.recipe.estimator.resolution:g} of the output's scale count as equal: where both "
        "lie there, they do not deviate."
    )
    return Section("Error estimate", text, rows, [figures.estimate_scatter(validations)])


def _timing_section(validation: Validation) -> Section:
    data = validation.figures()["timing"]
    rows = [
        ("set, doStep and get through fmpy, median", "per step"),
        ("FMU", f"{data['fmu_step_us']:.3g} us"),
    ]
    if "speedup" in data:
        rows.append(("reference FMU", f"{data['reference_step_us']:.3g} us"))
        rows.append(("ratio", f"{data['speedup']:.3g}"))
    return Section("Time per step", "Both measured in one run on one machine.", rows)


def _known(output: Mapping[str, Any], key: str) -> str:
    return _percent(output[key]) if key in output else ""


def _percent(value: float) -> str:
    return f"{100 * value:.3g} %"


def _e(value: float) -> str:
    return f"{value:.2e}"
