"""Sections of a report on the plain call of an FMU, and on constant inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from slide_fmu.core.measures import percent
from slide_fmu.core.units import behind
from slide_fmu.report.report import Report, Section
from slide_fmu.validation.box import TEXT as BOX_TEXT
from slide_fmu.validation.box import TITLES
from slide_fmu.validation.plain_call import TEXT


def with_plain_call(report: Report, found: Mapping[str, Any] | None) -> Report:
    """Return the report with the figures of the plain call, which come first."""
    if found is None:
        return report
    text = TEXT.replace("`", "")  # marks of code are the model card's
    section = Section("Plain call", f"{text} {whole(found)}", plain_call_rows(found))
    data = {**report.data, "plain_call": dict(found)}
    return replace(report, data=data, sections=[section, *report.sections])


def whole(found: Mapping[str, Any]) -> str:
    """Return the sentence of the figures as one that stands alone."""
    sentence = str(found["sentence"])
    return f"{sentence[0].upper()}{sentence[1:]}."


def plain_call_rows(found: Mapping[str, Any]) -> list[Sequence[str]]:
    """Return the table of the figures, its heading first; empty columns are left out."""
    columns = {
        "smooth": "smooth inputs",
        "smooth_worst": "worst smooth motion",
        "rough": "inputs as in the training",
        "known_to_step_end": "inputs known to the step's end",
        "smooth_covered": "covered by the bound under smooth inputs",
        "smooth_if_held": "smooth inputs, which are held for a step",
    }
    shown = [key for key in columns if any(o.get(key) is not None for o in found["outputs"])]
    rows: list[Sequence[str]] = [("output", *(columns[key] for key in shown))]
    rows += [
        (
            output["name"],
            *("" if output.get(key) is None else percent(output[key]) for key in shown),
        )
        for output in found["outputs"]
    ]
    return rows


def with_box(report: Report, found: Mapping[str, Any] | None) -> Report:
    """Return the report with the figures at constant inputs, behind its first section."""
    if found is None:
        return report
    section = Section("Constant inputs", box_text(found), box_rows(found))
    first, *others = report.sections
    data = {**report.data, "box": dict(found)}
    return replace(report, data=data, sections=[first, section, *others])


def box_text(found: Mapping[str, Any]) -> str:
    """Say how constant inputs were measured, and where the reference failed."""
    failed = [text for group in found.values() for text in group.get("failed", [])]
    return BOX_TEXT + "".join(
        f" The reference could not be simulated at {text}." for text in failed
    )


def box_rows(found: Mapping[str, Any]) -> list[Sequence[str]]:
    """Return the table of the figures, its heading first."""
    covers = any("covered" in output for group in found.values() for output in group["outputs"])
    heading = ("inputs", "output", "relative RMSE", "largest error")
    rows: list[Sequence[str]] = [(*heading, "covered by the bound") if covers else heading]
    for name, group in found.items():
        for output in group["outputs"]:
            unit = behind(output["unit"])
            row = (
                f"{TITLES[name]} ({group['points']} points)",
                output["name"],
                percent(output["relative_rmse"]),
                f"{output['largest_error']:.3g}{unit}",
            )
            rows.append((*row, percent(output["covered"])) if covers else row)
    return rows
