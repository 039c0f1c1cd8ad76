"""Sections of a report show how accurate a surrogate is, and how fast."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from slide_fmu.core.measures import percent
from slide_fmu.core.units import behind
from slide_fmu.core.web.charts import Bar
from slide_fmu.report import figures
from slide_fmu.report.frequency_charts import frequency_sections
from slide_fmu.report.report import Section
from slide_fmu.report.tables import about_parameters, parameter_rows, scientific
from slide_fmu.report.trajectory_charts import phase_charts, trajectory_charts
from slide_fmu.report.trust_sections import bound_sections, estimate_section
from slide_fmu.report.validity import RULE, is_ruled, judgement_rows, judgements
from slide_fmu.report.worst_windows import worst_section
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.validation.comparison import Validation, meaning_of
from slide_fmu.validation.record_noise import ORIGINS, origin_of_noise
from slide_fmu.validation.response import exact_matrix, learnt_matrix, matrix_figures

PHASE = (
    "Every output over its speed, around the largest error of its worst trajectory, as splines "
    "through the samples: a wrong period shows as curves that come apart, a wrong rest as curves "
    "about different places."
)

OF_RECORDS = "relative_noise_floor", "free_relative_rmse"
"""Figures of outputs that were measured: the noise, and the error of the network run freely."""

MODEL_TEXT = (
    " The reference is a finer model than the one that made the data; what that one errs on the "
    "same inputs stands beside the surrogate's error."
)


def validation_sections(validations: Mapping[str, Validation]) -> list[Section]:
    """Return the sections on the accuracy; the first validation is the one in range."""
    main = next(iter(validations.values()))
    worst, phases = worst_section(main), phase_charts(main)
    sections = [
        Section(
            "Side by side with the reference",
            _compared(main)
            + (MODEL_TEXT if main.recipe.system.reference else "")
            + moving_text(main.surrogate, main.recipe.system.is_record),
            _accuracy_rows(validations),
            charts=trajectory_charts(main),
        ),
        _kinds_section(main),
        _validity_section(validations),
        *frequency_sections(main),
        *([Section("Phase plot", PHASE, charts=phases)] if phases else []),
        *([] if worst is None else [worst]),
    ]
    if main.surrogate.parameters:
        text = about_parameters(main.recipe.system.is_record)
        rows = parameter_rows(main.figures()["parameters"])
        sections.append(Section("Physical parameters", text, rows))
    if main.surrogate.estimates_errors:
        sections.append(estimate_section(validations))
    if main.surrogate.bound is not None:
        sections += bound_sections(validations)
    sections.append(_timing_section(main))
    return sections


def _kinds_section(validation: Validation) -> Section:
    """Show the relative RMSE by kind of excitation, the largest over the outputs."""
    bars = []
    for row in validation.figures()["excitations"]:
        error, count = max(row["relative_rmse"]), row["trajectories"]
        many = f"{count} trajector{'y' if count == 1 else 'ies'}"
        bars.append(Bar(row["name"], error, f"{percent(error)}, {many}"))
    return Section(
        "By file" if validation.recipe.system.is_record else "By kind of excitation",
        "Relative RMSE: RMSE of the FMU over the RMS of the reference about its mean; of several "
        "outputs the largest.",
        bars=bars,
    )


def _validity_section(validations: Mapping[str, Validation]) -> Section:
    """Return the section that says in words where the surrogate is valid."""
    main = next(iter(validations.values()))
    figures = {name: validation.figures() for name, validation in validations.items()}
    found = judgements(main.surrogate, main.recipe, figures)
    text = RULE if is_ruled(found) else ""
    return Section("Where it is valid", text, judgement_rows(found))


def moving_text(surrogate: Surrogate, is_record: bool) -> str:
    """Say what is set before a step, of inputs with a first-order hold; nothing of others."""
    if surrogate.hold == "zero_order":
        return ""
    return (
        f" {'The FMU is' if is_record else 'Both FMUs are'} told what the inputs reach by each "
        "step's end. An importer that sets what they are at its start, which is all that a plain "
        "simulation does, has the errors of the "
        f'column "inputs set to what they are now": {meaning_of(surrogate)}.'
    )


def response_section(surrogate: Surrogate, system: System) -> tuple[Section, dict[str, Any]]:
    """The learnt response matrix of an affine surrogate against the exact one."""
    learnt, exact = learnt_matrix(surrogate), exact_matrix(system, surrogate.window)
    data = matrix_figures(learnt, exact)
    rows = [
        ("figure", "value"),
        (
            "largest deviation, relative to the largest entry",
            scientific(data["max_deviation_relative"]),
        ),
        ("largest entry above the diagonal, absolute", scientific(data["max_above_diagonal"])),
        (
            "the same, relative to the largest entry",
            scientific(data["max_above_diagonal_relative"]),
        ),
    ]
    text = (
        "Every row is one output sample of the window, every column one input sample. Entries "
        "above the diagonal would mean that an output answers to a later input."
    )
    return Section("Response matrix", text, rows, [figures.response_matrices(learnt, exact)]), data


def _compared(validation: Validation) -> str:
    """Say what was compared with what."""
    count = len(validation.comparisons)
    if validation.recipe.system.is_record:
        return (
            f"{count} blocks of the records that nothing was learnt or chosen from, and the FMU "
            "run on their inputs. What was measured has noise of its own, which no surrogate can "
            f"predict: its RMS is known {ORIGINS[origin_of_noise(validation.recipe)]}. Run "
            "freely, never handed over from window to window, the network begins with the state "
            "that the lead of a block shows."
        )
    return (
        f"{count} trajectories that no training saw (seed {validation.task.seed}), the FMU and "
        "the reference FMU run by the same importer."
    )


def _accuracy_rows(validations: Mapping[str, Validation]) -> list[Sequence[str]]:
    with_model = any(validation.recipe.system.reference for validation in validations.values())
    moving = any(v.surrogate.hold == "first_order" for v in validations.values())
    measured = any(v.recipe.system.is_record for v in validations.values())
    rows: list[Sequence[str]] = [
        (
            "inputs",
            "output",
            "RMS of the reference about its mean",
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
                    f"{output['rms_reference_about_mean']:.4g}{behind(unit)}",
                    f"{output['rmse']:.4g}{behind(unit)}",
                    percent(output["relative_rmse"]),
                    f"{percent(single['median'])} ({percent(single['p10'])} .. "
                    f"{percent(single['p90'])})",
                    f"{output['max_error']:.4g}{behind(unit)}",
                    *([percent(output["plain_relative_rmse"])] if moving else []),
                    *([percent(output["model_relative_rmse"])] if with_model else []),
                    *([_known(output, key) for key in OF_RECORDS] if measured else []),
                )
            )
    return rows


def _timing_section(validation: Validation) -> Section:
    data = validation.figures()["timing"]
    rows = [
        ("set, doStep and get through fmpy, median", "per step"),
        ("FMU", f"{data['fmu_step_us']:.3g} µs"),
    ]
    if "speedup" in data:
        rows.append(("reference FMU", f"{data['reference_step_us']:.3g} µs"))
        rows.append(("ratio", f"{data['speedup']:.3g}"))
    return Section("Time per step", "Both measured in one run on one machine.", rows)


def _known(output: Mapping[str, Any], key: str) -> str:
    return percent(output[key]) if key in output else ""
