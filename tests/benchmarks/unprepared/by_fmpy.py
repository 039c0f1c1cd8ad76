"""True outputs of the FMU of another tool: fmpy runs it at a finer step."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from slide_fmu.core.signals import FloatArray
from tests.benchmarks.unprepared.kinds import Motion
from tests.benchmarks.unprepared.models import Model, Wanted

FINE = 2
"""Number of steps from one time to the next."""


def by_fmpy(model: Model, wanted: Wanted, motions: Sequence[Motion]) -> list[FloatArray]:
    """Run the FMU by fmpy; inputs are those at the middle of each step."""
    import fmpy
    from fmpy.fmi2 import FMU2Slave

    with TemporaryDirectory() as folder:
        path = str(model.write(Path(folder)))
        description = fmpy.read_model_description(path)
        unpacked = fmpy.extract(path, str(Path(folder) / "unpacked"))
        variables = description.modelVariables
        offered = ({v.name for v in variables if v.causality == c} for c in ("input", "output"))
        wanted.require(*offered)
        numbers = {v.name: v.valueReference for v in variables}
        ins, outs = ([numbers[n] for n in names] for names in (wanted.inputs, wanted.outputs))
        even = np.linspace(0, wanted.times[-1], (len(wanted.times) - 1) * FINE + 1)
        found = []
        for motion in motions:
            times = np.unique(np.round(np.concatenate([even, motion.drawn.breaks]), 9))
            rows = motion(0.5 * (times[:-1] + times[1:]))
            slave = FMU2Slave(
                guid=description.guid,
                unzipDirectory=unpacked,
                modelIdentifier=description.coSimulation.modelIdentifier,
                instanceName="truth",
            )
            slave.instantiate()
            slave.setupExperiment(startTime=0.0)
            slave.enterInitializationMode()
            slave.setReal(ins, motion(0.0)[0].tolist())
            slave.exitInitializationMode()
            values = [slave.getReal(outs)]
            for begin, length, row in zip(times[:-1], np.diff(times), rows, strict=True):
                slave.setReal(ins, row.tolist())
                slave.doStep(float(begin), float(length))
                values.append(slave.getReal(outs))
            slave.terminate()
            slave.freeInstance()
            columns = np.array(values).T
            found.append(np.stack([np.interp(wanted.times, times, c) for c in columns], axis=1))
    return found
