"""A lag as FMU of FMI 2.0 for co-simulation, which refuses what its description does not allow."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slide_fmu.core.signals import FloatArray
from tests.own_models.quarter_car import HERE, compiled, write_fmu

LAG = 0.1
"""Its time constant in s; another copy is in C."""


def build_strict_lag(  # noqa: PLR0913 - ways in which an FMU may be strict, or worse
    path: Path,
    *,
    only_one: bool = False,
    only_step: float | None = None,
    names_step: bool = True,
    start: float | None = 0.0,
    clock: float | None = None,
    end: float | None = None,
    told_end: bool = False,
    at_start: str = "",
    at_step: str = "",
    states: bool = False,
) -> Path:
    """Compile the lag of ``c/strict_lag_fmi2.c``, and write it as FMU.

    Args:
        path: the file to write.
        only_one: whether one instance in a process is all that it allows.
        only_step: the step in s whose multiples alone it takes.
        names_step: whether its default experiment names that step, or else 0.01 s.
        start: the only start time in s that it takes; any if None.
        clock: the time in s from which on another drive acts too.
        end: the time in s beyond which it takes no step, that of its default experiment.
        told_end: whether it goes on to the stop time that it is told, if it is told one.
        at_start, at_step: statements in C that it does first when it is set up, and in each step
            of a length ``step`` from a time ``begin``.
        states: whether it can go back to a former state.
    """
    flags = [] if start is None else [f"-DSTART={start!r}"]
    flags += [] if clock is None else [f"-DCLOCK={clock!r}"]
    flags += ["-DONLY_ONE"] if only_one else []
    flags += [] if only_step is None else [f"-DONLY_STEP={only_step!r}"]
    flags += [f"-DAT_START={at_start}"] * bool(at_start) + ["-DSTATES"] * states
    flags += [f"-DAT_STEP={at_step}"] * bool(at_step)
    flags += [] if end is None else [f"-DEND={end!r}"] + ["-DTOLD_END"] * told_end
    source = (HERE / "c" / "strict_lag_fmi2.c").read_text(encoding="utf-8")
    library = compiled(source, path.with_suffix(".so"), tuple(flags))
    booleans = {"any": only_step is None, "once": only_one, "back": states}
    words = {name: str(value).lower() for name, value in booleans.items()}
    step = f'stepSize="{only_step or 0.01}"' if names_step else ""
    stop = "" if end is None else f'stopTime="{end}"'
    text = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="lag" guid="{{{path.stem}}}">
  <CoSimulation modelIdentifier="lag" canBeInstantiatedOnlyOncePerProcess="{words["once"]}"
      canHandleVariableCommunicationStepSize="{words["any"]}"
      canGetAndSetFMUstate="{words["back"]}"/>
  <DefaultExperiment startTime="{start or 0.0}" {stop} {step}/>
  <ModelVariables>
    <ScalarVariable name="drive" valueReference="0" causality="input">
      <Real start="0" min="-1" max="1"/></ScalarVariable>
    <ScalarVariable name="level" valueReference="1" causality="output">
      <Real min="-1" max="1"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" dependencies=""/></Outputs></ModelStructure>
</fmiModelDescription>
"""
    return write_fmu(path, text, library, "lag", fmi=2)


def true_level(drive: FloatArray, step: float) -> FloatArray:
    """Return the level at t_0 .. t_N, (N + 1,), under inputs that are held over steps, (N,)."""
    levels = [float(drive[0])]
    for value in drive:
        levels.append(levels[-1] + (1 - np.exp(-step / LAG)) * (value - levels[-1]))
    return np.array(levels)
