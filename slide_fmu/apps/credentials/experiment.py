"""An FMU carries an experiment: inputs, its own outputs, and outputs of its reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from slide_fmu.apps.credentials import members
from slide_fmu.apps.credentials.members import link, member
from slide_fmu.apps.credentials.schema import CredentialError, parsed
from slide_fmu.apps.credentials.tables import read_table, write_table
from slide_fmu.core.measures import relative_rmse, size_about
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.ssv import parameter_set, parameters_of
from slide_fmu.fmu.description.fmi2 import document
from slide_fmu.fmu.export import read_member

NAME = "side_by_side"


@dataclass(frozen=True, eq=False)
class Experiment:
    """An Experiment is a run that any importer can repeat.

    Attributes:
        step: communication step in s.
        inputs: by name, values set before each step from t_0 on, (N,) each.
        results: by name, values of the FMU at t_0 .. t_N, (N + 1,) each.
        reference: by name, values of the reference at the last of these times, from the first
            comparable sample on, (M,) each.
        parameters: values by name that are set before the start.
    """

    step: float
    inputs: Mapping[str, FloatArray]
    results: Mapping[str, FloatArray]
    reference: Mapping[str, FloatArray]
    parameters: Mapping[str, float] = field(default_factory=dict)

    @property
    def steps(self) -> int:
        """The number of communication steps."""
        return len(next(iter(self.inputs.values())))

    @property
    def compared(self) -> int:
        """The number of samples with values of the reference."""
        return len(next(iter(self.reference.values())))

    def relative_errors(self) -> dict[str, float]:
        """Return, by output, the RMSE over the RMS of the reference about its mean."""
        errors = {}
        for name, truth in self.reference.items():
            known = np.isfinite(truth)
            error = (self.results[name][-len(truth) :] - truth)[known, None]
            errors[name] = float(relative_rmse(error, size_about(truth[known, None]))[0])
        return errors


def experiment_members(experiment: Experiment) -> dict[str, bytes]:
    """Return the files of an experiment, by their names in an FMU."""
    time = experiment.step * np.arange(experiment.steps + 1, dtype=np.float64)
    # importers that interpolate need inputs up to the end
    inputs = {name: np.append(u, u[-1:]) for name, u in experiment.inputs.items()}
    files = {
        members.EXPERIMENTS: _document(experiment),
        members.INPUTS: write_table(time, inputs),
        members.RESULTS: write_table(time, experiment.results),
        members.REFERENCE_MODEL: write_table(time[-experiment.compared :], experiment.reference),
    }
    if experiment.parameters:
        files[members.PARAMETERS] = parameter_set(experiment.parameters)
    return files


def read_experiment(fmu: Path) -> Experiment | None:
    """Read the experiment that slide-fmu has put into an FMU; None if it has none.

    Raises:
        CredentialError: a file of it is missing or damaged, or they do not match.
        FmuError: the file is not an FMU.
        OSError: the file cannot be read.
    """
    content = read_member(fmu, members.EXPERIMENTS)
    if content is None:
        return None
    element = parsed(content, members.EXPERIMENTS, "experiments").find("Experiment")
    step = float(element.get("stepSize", "nan"))
    times, inputs = _linked(fmu, element, "Stimuli")
    ends, results = _linked(fmu, element, "References")
    reference = read_table(_required(fmu, members.REFERENCE_MODEL), members.REFERENCE_MODEL)[1]
    own = step * np.arange(len(times), dtype=np.float64)
    if not (len(times) == len(ends) > 1 and np.allclose(times, own) and np.allclose(ends, own)):
        raise CredentialError(
            f"{members.EXPERIMENTS}: steps of {step} s, {len(times)} times of inputs and "
            f"{len(ends)} of results; expected the same times in both, a step apart from 0 on"
        )
    without = [name for name in reference if name not in results]
    if without or not 0 < len(next(iter(reference.values()))) <= len(ends):
        raise CredentialError(
            f"{members.REFERENCE_MODEL} has the columns {sorted(reference)}; expected outputs of "
            f"{members.RESULTS}, {sorted(results)}, and at most as many rows"
        )
    stimuli = {name: values[:-1] for name, values in inputs.items()}
    return Experiment(step, stimuli, results, reference, _parameters(fmu, element))


def _linked(fmu: Path, experiment: Any, tag: str) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Read the table that an element of an experiment names."""
    element = experiment.find(tag)
    if element is None:
        raise CredentialError(f"{members.EXPERIMENTS} has no element {tag}; expected one")
    name = member(element.get("source"), members.EXPERIMENTS)
    return read_table(_required(fmu, name), name)


def _parameters(fmu: Path, experiment: Any) -> dict[str, float]:
    element = experiment.find("Parameters")
    if element is None:
        return {}
    name = member(element.get("source"), members.EXPERIMENTS)
    try:
        return parameters_of(_required(fmu, name), name)
    except CredentialError:
        raise
    except ValueError as error:
        raise CredentialError(str(error)) from error


def _required(fmu: Path, name: str) -> bytes:
    content = read_member(fmu, name)
    if content is None:
        raise CredentialError(
            f"{name} is missing; expected it, since {members.EXPERIMENTS} needs it: write the FMU "
            "again with slide-fmu export"
        )
    return content


def _document(experiment: Experiment) -> bytes:
    """Write the experiments file, with one experiment."""
    root = ElementTree.Element(
        "Experiments",
        name="smoke tests",
        description="Runs that show whether the FMU gives here what it gave when it was made.",
    )
    attributes = {
        "name": NAME,
        "description": "Inputs that no training saw; a row is set before the step that begins at "
        "its time.",
        "startTime": "0.0",
        "stopTime": repr(experiment.step * experiment.steps),
        "stepSize": repr(experiment.step),
    }
    parent = ElementTree.SubElement(root, "Experiment", attributes)
    sources = {"Stimuli": members.INPUTS, "References": members.RESULTS}
    types = {"Stimuli": members.CSV, "References": members.CSV, "Parameters": members.SSV}
    if experiment.parameters:
        sources = {"Parameters": members.PARAMETERS, **sources}
    for tag, name in sources.items():
        source = link(name, members.EXPERIMENTS)
        ElementTree.SubElement(parent, tag, type=types[tag], source=source)
    return document(root)
