"""Node runs the runtime as WebAssembly, with the modules of the page."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.apps.credentials.experiment import Experiment, read_experiment
from slide_fmu.apps.page.facts import page_facts
from slide_fmu.core.figures import plain
from slide_fmu.fmu.export import read_fmu
from slide_fmu.fmu.libraries.build import BINARIES, PAGE_LIBRARY
from slide_fmu.surrogate.surrogate import Surrogate
from tests.limits import HANGS
from tests.node import node

RUNNER = Path(__file__).parent / "run_fmu.mjs"
CONFIDENCE = 0.95


def task_of(surrogate: Surrogate, experiment: Experiment, folder: Path) -> dict[str, Any]:
    """Return what Node is asked to run: the experiment, each row held until the next."""
    facts = page_facts(surrogate)
    path = folder / "surrogate.slide"
    path.write_bytes(surrogate.to_bytes())
    inputs = [experiment.inputs[signal.name] for signal in facts.inputs]
    time = experiment.step * np.arange(experiment.steps + 1)
    given = experiment.parameters
    return {
        "runtime": str(BINARIES / PAGE_LIBRARY),
        "surrogate": str(path),
        "facts": plain(facts),
        "time": time.tolist(),
        "inputs": [np.append(values, values[-1:]).tolist() for values in inputs],
        "parameters": [given.get(p.name, p.start) for p in facts.parameters],
        "confidence": CONFIDENCE,
    }


def task_of_fmu(fmu: Path, folder: Path) -> dict[str, Any]:
    """Return the task of the experiment that an FMU carries."""
    experiment = read_experiment(fmu)
    assert experiment is not None
    return task_of(read_fmu(fmu)[0], experiment, folder)


def run_task(task: dict[str, Any], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a task in Node."""
    path = folder / "task.json"
    path.write_text(json.dumps(task), encoding="utf-8")
    command = [node(), str(RUNNER), str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=HANGS)
