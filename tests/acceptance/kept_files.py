"""Files of a version are kept, so that later versions prove that they still read them.

    python -m tests.acceptance.kept_files

writes what this version makes to ``tests/acceptance/kept/VERSION``, once with each release:
surrogate files of each kind of content, two FMUs without their libraries and reports, two recipes,
and in ``answers.json`` what they answered and what ``info --json`` printed. A folder of a released
version is never written again.
"""

from __future__ import annotations

import json
import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

import slide_fmu
from slide_fmu.core.figures import plain
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import DESCRIPTION, PROVENANCE, SURROGATE, read_fmu
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import bounded_surrogate, with_plain, with_span, with_tolerances
from tests.fmu.samples import CellShape, Shape, random_surrogate

ROOT = Path(__file__).parents[2]
KEPT = Path(__file__).parent / "kept"
FMUS = ("linear", "duffing")
RECIPES = ("duffing", "slider_crank_payload")
SAMPLES = 40
DIGITS = 9
"""Significant digits that are kept of an answer."""

_CELL = Shape(n_in=24, n_out=5, n_outputs=2, cell=CellShape())
SPECIMENS = {
    "estimator": lambda: random_surrogate(Shape(hidden=(6,), positions=3)),
    "parameters": lambda: random_surrogate(
        Shape(n_in=24, n_out=5, cell=CellShape(units=2, parameters=1))
    ),
    "moving_inputs": lambda: random_surrogate(
        Shape(n_in=24, n_out=5, cell=CellShape(units=2), hold="first_order", forecasts=True)
    ),
    "director": lambda: random_surrogate(
        Shape(
            n_in=24,
            n_out=5,
            n_inputs=2,
            features="director",
            hold="first_order",
            cell=CellShape(units=2, activation="gated", turned=1),
        )
    ),
    "chain": lambda: random_surrogate(
        Shape(n_inputs=2, features="chain", activation="gelu", hidden=(5,))
    ),
    "roles": lambda: random_surrogate(
        Shape(
            n_in=24,
            n_out=5,
            differences=2,
            cell=CellShape(units=2, activation="cubic", roles=True, factors=1),
        )
    ),
    "bound": lambda: bounded_surrogate(_CELL),
    "bound_and_span": lambda: with_span(bounded_surrogate(_CELL)),
    "bound_and_tolerances": lambda: with_tolerances(bounded_surrogate(_CELL)),
    "bound_of_the_plain_call": lambda: with_plain(with_tolerances(bounded_surrogate(_CELL))),
}
"""Surrogates of random weights by the names of their files; together they have every section."""


def folder_of(version: str) -> Path:
    """Return the folder of a version, such as ``0.7``: patches and states before it share it."""
    return KEPT / ".".join(version.split(".")[:2])


def inputs_of(surrogate: Surrogate) -> FloatArray:
    """Return inputs over their ranges, (SAMPLES, n_inputs), the same in every version."""
    time = np.arange(SAMPLES)[:, None]
    order = 1 + np.arange(len(surrogate.inputs))
    places = np.sin(order + 0.37 * order * time + 0.02 * time**1.5)
    low, high = (np.array([getattr(s, end) for s in surrogate.inputs]) for end in ("low", "high"))
    return np.asarray(low + 0.5 * (1 + places) * (high - low))


def answers_of(surrogate: Surrogate) -> dict[str, Any]:
    """Return everything that a surrogate says of a record of inputs."""
    inputs = inputs_of(surrogate)
    found: dict[str, Any] = {"outputs": surrogate.predict_newest(inputs)}
    if surrogate.estimates_errors:
        found["estimates"] = surrogate.estimate_error(inputs)
    if surrogate.bound is not None:
        found["bounds"] = surrogate.error_bounds(inputs)
        found["in_domain"] = surrogate.in_domain(inputs)
        if surrogate.bound.tolerances is not None:
            found["trusted"] = surrogate.trusted(inputs)
            found["tolerances"] = surrogate.error_tolerances
    if surrogate.parameters:
        ends = {parameter.signal.name: parameter.signal.high for parameter in surrogate.parameters}
        found["outputs_at_the_highest"] = surrogate.at(ends).predict_newest(inputs)
    return {name: _rounded(np.asarray(values)) for name, values in found.items()}


def _rounded(values: FloatArray) -> Any:
    """Return an array as lists, with few digits."""
    short = np.vectorize(lambda value: float(f"{value:.{DIGITS - 1}e}"), otypes=[float])
    return (values if values.dtype == bool else short(values)).tolist()


def described(fmu: Path) -> Any:
    """Return what ``slide-fmu info --json`` prints of an FMU."""
    return plain(FmuDescription.of(*read_fmu(fmu)).dump())


def _strip(fmu: Path, path: Path) -> None:
    """Write an FMU without what takes the room and is not read again."""
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(path, "w") as target:
        for name in (DESCRIPTION, SURROGATE, PROVENANCE):
            if name in source.namelist():
                member = zipfile.ZipInfo(name)
                target.writestr(member, source.read(name), zipfile.ZIP_DEFLATED)


def write(folder: Path) -> None:
    """Write all files of this version."""
    folder.mkdir(parents=True, exist_ok=True)
    answers: dict[str, Any] = {}
    for name, made in SPECIMENS.items():
        surrogate = made()
        surrogate.save(folder / f"{name}.slide")
        answers[f"{name}.slide"] = answers_of(surrogate)
    for name in FMUS:
        fmu = folder / f"{name}.fmu"
        _strip(ROOT / "fmus" / name / f"{name}.fmu", fmu)
        answers[fmu.name] = {**answers_of(read_fmu(fmu)[0]), "info": described(fmu)}
    for name in RECIPES:
        shutil.copyfile(ROOT / "training" / f"{name}.toml", folder / f"{name}.toml")
    text = json.dumps(answers, default=float)
    (folder / "answers.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    write(folder_of(slide_fmu.__version__))
