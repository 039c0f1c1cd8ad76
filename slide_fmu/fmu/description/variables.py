"""This table has all kinds of variables that an FMU of slide-fmu can have.

Model descriptions of FMI 2.0 and FMI 3.0, the dispatch of the C runtime (by the generated header
``runtime/calls/variable_kinds.h``) and ``docs/variables.md`` are all made from this table. After a
change, ``python -m slide_fmu.fmu.description.generate`` writes the generated files.

A value reference is the number of its kind times ``REFERENCES_PER_KIND`` plus an index within the
kind. So it is the same in both standards, and stays the same when a kind is added or a surrogate
has another number of inputs. The number of a kind is never used again.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

REFERENCES_PER_KIND = 1_000_000
"""It is a power of ten, so that people can read kind and index in a value reference. 2147 kinds
fit into 31 bits, for importers that read references as signed numbers."""

WINDOW_FILLED = "window_filled"
ESTIMATE_FILLED = "error_estimate_filled"
IN_RANGE = "inputs_in_range"
OUTPUTS_IN_RANGE = "outputs_in_range"
PREHISTORY_KNOWN = "prehistory_known"
ERROR_ESTIMATE = "{signal}_error_estimate"
TRUNCATION_ERROR = "{signal}_truncation_error"
INITIAL = "initial_{signal}"
AT_STEP_END = "inputs_at_step_end"
HELD = "inputs_held"
PARAMETERS_SETTLED = "parameters_settled"
ERROR_BOUND = "{signal}_error_bound"
IN_DOMAIN = "in_domain"
NOVELTY = "novelty"
BOUND_FILLED = "error_bound_filled"
CONFIDENCE = "confidence"
ERROR_TOLERANCE = "{signal}_error_tolerance"
TRUSTED = "trusted"

TRUST = (IN_DOMAIN, NOVELTY, BOUND_FILLED, TRUSTED)
"""Variables by which an FMU with an error bound says how far its outputs can be relied on. The
flag ``TRUSTED`` is false until ``BOUND_FILLED``, the part of the past that is known, is 1."""

Per = Literal["one", "input", "output", "parameter"]
When = Literal[
    "always",
    "estimator",
    "state_space",
    "several_samples",
    "first_order",
    "zero_order",
    "parameters",
    "bound",
    "output_ranges",
    "known_start",
]
Size = Literal["scalar", "block", "sampled"]
Initially = Literal["nothing", "prehistory", "everything"]
Bound = float | Literal["signal", "surrogate"] | None
Bounds = tuple[Bound, Bound, Bound]

SIGNAL: Bounds = ("signal", "signal", "signal")
SHARE: Bounds = (0.0, 1.0, None)
NOT_NEGATIVE: Bounds = (0.0, None, None)


@dataclass(frozen=True)
class VariableKind:
    """A VariableKind is one kind of variable; its instances differ in their signals alone.

    Attributes:
        number: determines the value references; never changes, never used again.
        key: name of the kind in C, without its prefix ``SLIDE_``.
        name: name of the variable; ``{signal}`` stands for the name of its signal.
        text: description for users, with placeholders ``{signal}``, ``{positions}`` (samples of an
            error estimate) and ``{size}`` (samples of an array).
        meaning: what it is, shorter than the text, for the table of ``docs/variables.md``.
        causality, variability: as in both standards.
        per: whether there is one variable, or one for each input, output, or physical parameter.
        when: condition on the surrogate: an error estimate, a state-space network, a network that
            knows several output samples at a time, inputs with a first-order hold, physical
            parameters, an error bound, known ranges of the outputs, or a state that outputs before
            the start can show.
        size: number of values: one; the output samples that the network knows at a time; or the
            input samples that any result depends on.
        fmi: the first version of the standard in which the variable exists.
        type: Real (Float64 in FMI 3.0) or Boolean.
        unit: None for the unit of the signal.
        bounds: lower bound, upper bound and start value. Each is a number, is taken from the
            signal or the surrogate, or is None. Outputs have no bounds, since predictions may
            leave the range that a recipe intends.
        high_fmi_3: another upper bound in FMI 3.0.
        initially: dependencies of an output in initialization mode: no variable, whether the
            prehistory is known, or all inputs and parameters. At a communication point, no output
            depends on the inputs that are set there.
        text_fmi_3: one more sentence of the description.
    """

    number: int
    key: str
    name: str
    text: str
    meaning: str
    causality: Literal["input", "output", "parameter", "independent", "local"]
    variability: Literal["continuous", "discrete", "fixed", "tunable"] = "continuous"
    per: Per = "one"
    when: When = "always"
    size: Size = "scalar"
    fmi: Literal[2, 3] = 2
    type: Literal["Real", "Boolean"] = "Real"
    unit: str | None = None
    bounds: Bounds = (None, None, None)
    high_fmi_3: float | None = None
    initially: Initially = "nothing"
    text_fmi_3: str = ""

    def reference(self, index: int = 0) -> int:
        """Return the value reference of the variable with an index within its kind.

        Raises:
            ValueError: the index does not fit.
        """
        if not 0 <= index < REFERENCES_PER_KIND:
            raise ValueError(
                f"{self.name}: index {index}; expected 0 to {REFERENCES_PER_KIND - 1}: a "
                "surrogate with more signals cannot become an FMU"
            )
        return self.number * REFERENCES_PER_KIND + index

    def name_for(self, signal: str) -> str:
        """Return the name of the variable that belongs to a signal."""
        return self.name.replace("{signal}", signal)


KINDS: tuple[VariableKind, ...] = (
    VariableKind(
        0,
        "INPUT",
        "{signal}",
        "This is an input; its range is that of the training.",
        "input; its range is the training's",
        "input",
        per="input",
        bounds=SIGNAL,
    ),
    VariableKind(
        1,
        "OUTPUT",
        "{signal}",
        "This output is predicted for the end of the communication step.",
        "output at the end of the step",
        "output",
        per="output",
        initially="everything",
    ),
    VariableKind(
        2,
        "ERROR_ESTIMATE",
        ERROR_ESTIMATE,
        "This is the estimated root mean square error of {signal} over the last {positions} "
        "samples; it costs time only when it is read.",
        "estimated RMS error over the last samples",
        "output",
        per="output",
        when="estimator",
        bounds=NOT_NEGATIVE,
        initially="everything",
    ),
    VariableKind(
        3,
        "WINDOW_FILLED",
        WINDOW_FILLED,
        "It says which part of the inputs behind the outputs was set in this run, from 0 to 1; "
        "trust the outputs once it is 1.",
        "outputs are valid once it is 1",
        "output",
        unit="1",
        bounds=SHARE,
        initially="prehistory",
    ),
    VariableKind(
        4,
        "ESTIMATE_FILLED",
        ESTIMATE_FILLED,
        "It says which part of the inputs behind the error estimates was set in this run, from 0 "
        "to 1; trust the estimates once it is 1.",
        "error estimates are valid once it is 1",
        "output",
        when="estimator",
        unit="1",
        bounds=SHARE,
        initially="prehistory",
    ),
    VariableKind(
        5,
        "TRUNCATION_ERROR",
        TRUNCATION_ERROR,
        "This is what {signal} lost by forgetting inputs older than the window; it is measured "
        "once per window.",
        "loss by forgetting inputs older than the window",
        "output",
        per="output",
        when="state_space",
        bounds=NOT_NEGATIVE,
        initially="everything",
    ),
    VariableKind(
        6,
        "IN_RANGE",
        IN_RANGE,
        "It is true when all inputs behind the outputs lay in their ranges.",
        "all inputs behind the outputs lay in their ranges",
        "output",
        "discrete",
        type="Boolean",
        initially="everything",
    ),
    VariableKind(
        7,
        "PREHISTORY_KNOWN",
        PREHISTORY_KNOWN,
        "With 1, the inputs had their initial values for all time before the start; with 0, the "
        "first input counts as held for all time before it.",
        "before the start, inputs were: 0 the first input; 1 `initial_<input>`; 2 (FMI 3.0) "
        "`initial_<input>_window`; 3 (FMI 3.0) the same, and outputs `initial_<output>_window`",
        "parameter",
        "fixed",
        unit="1",
        bounds=(0.0, 1.0, 0.0),
        high_fmi_3=3.0,
        text_fmi_3="With 2, initial_<input>_window gives the last samples before the start. With "
        "3, which only some FMUs know, initial_<output>_window gives measured outputs besides.",
    ),
    VariableKind(
        8,
        "INITIAL_INPUT",
        INITIAL,
        f"This was the value of {{signal}} before the start, where {PREHISTORY_KNOWN} is 1.",
        "value before the start",
        "parameter",
        "fixed",
        per="input",
        bounds=SIGNAL,
    ),
    VariableKind(
        9,
        "TIME",
        "time",
        "This is the simulation time.",
        "simulation time in s",
        "independent",
        fmi=3,
        unit="s",
    ),
    VariableKind(
        10,
        "OUTPUT_WINDOW",
        "{signal}_window",
        "These are the last {size} samples of {signal}, oldest first, as the network sees them "
        "now; they cost time only when they are read.",
        "last samples of the output, oldest first",
        "local",
        per="output",
        when="several_samples",
        size="block",
        fmi=3,
    ),
    VariableKind(
        11,
        "INITIAL_WINDOW",
        f"{INITIAL}_window",
        f"These were the last {{size}} samples of {{signal}} before the start, oldest first, "
        f"where {PREHISTORY_KNOWN} is 2 or 3.",
        "last samples before the start, oldest first",
        "parameter",
        "fixed",
        per="input",
        size="sampled",
        fmi=3,
        bounds=SIGNAL,
    ),
    VariableKind(
        12,
        "INPUTS_AT_STEP_END",
        AT_STEP_END,
        "With 0, inputs are set to what they are at the start of a communication step, and what "
        "they do within it is forecast until they are set again; with 1, they are set to what "
        "they reach by its end.",
        "inputs are those at: 0 the start of the step, with a forecast; 1 its end",
        "parameter",
        "fixed",
        when="first_order",
        unit="1",
        bounds=(0.0, 1.0, "surrogate"),
    ),
    VariableKind(
        13,
        "MODEL_PARAMETER",
        "{signal}",
        "This is a physical parameter of the model; its range is that of the training, and values "
        "outside are refused. It may be changed between communication steps.",
        "physical parameter; values outside its range are refused",
        "parameter",
        "tunable",
        per="parameter",
        when="parameters",
        bounds=SIGNAL,
    ),
    VariableKind(
        14,
        "PARAMETERS_SETTLED",
        PARAMETERS_SETTLED,
        "It says which part of the window behind the outputs passed since a physical parameter "
        "was changed in this run, from 0 to 1; until it is 1, the outputs go over from the "
        "response with the former parameters.",
        "outputs are those of the new parameters once it is 1",
        "output",
        when="parameters",
        unit="1",
        bounds=SHARE,
    ),
    VariableKind(
        15,
        "ERROR_BOUND",
        ERROR_BOUND,
        "The error of {signal} at this sample stays below it with the probability of the "
        "parameter confidence, for inputs of the kinds that it was calibrated on; where in_domain "
        "is false it is not calibrated, and may be too small. It costs time only when it is read.",
        "limit of this sample's error, with the probability `confidence`",
        "output",
        per="output",
        when="bound",
        bounds=NOT_NEGATIVE,
        initially="everything",
    ),
    VariableKind(
        16,
        "IN_DOMAIN",
        IN_DOMAIN,
        "It is true when the inputs behind the outputs are like those that the error bound was "
        "calibrated on: novelty is at most 1, and inputs_in_range is true. It costs time only "
        "when it is read.",
        "inputs are like those of the calibration; if false, bounds may be far too small",
        "output",
        "discrete",
        type="Boolean",
        when="bound",
        initially="everything",
    ),
    VariableKind(
        17,
        "NOVELTY",
        NOVELTY,
        "It says how far the inputs behind the outputs go beyond those that the error bound was "
        "calibrated on; it is 1 at the edge of the domain. It costs time only when it is read.",
        "distance of the inputs from the calibration; 1 is the edge of the domain",
        "output",
        when="bound",
        unit="1",
        bounds=NOT_NEGATIVE,
        initially="everything",
    ),
    VariableKind(
        18,
        "BOUND_FILLED",
        BOUND_FILLED,
        "It says which part of the inputs behind error bounds and novelty was set in this run, "
        "from 0 to 1; trust them once it is 1.",
        "bounds and novelty are valid once it is 1",
        "output",
        when="bound",
        unit="1",
        bounds=SHARE,
        initially="prehistory",
    ),
    VariableKind(
        19,
        "CONFIDENCE",
        CONFIDENCE,
        "This is the probability with which errors stay below the error bounds; values outside "
        "its range are refused. It may be changed between communication steps.",
        "probability of error bounds",
        "parameter",
        "tunable",
        when="bound",
        unit="1",
        bounds=(0.9, 0.99, 0.95),
    ),
    VariableKind(
        20,
        "OUTPUTS_IN_RANGE",
        OUTPUTS_IN_RANGE,
        "It is true when all outputs lie in the ranges that they had in the training; where it is "
        "false, nothing like it was learnt.",
        "all outputs lie in the ranges of the training",
        "output",
        "discrete",
        type="Boolean",
        when="output_ranges",
        initially="everything",
    ),
    VariableKind(
        21,
        "ERROR_TOLERANCE",
        ERROR_TOLERANCE,
        "This is the largest 95 % error bound of {signal} with which trusted is true; it starts "
        "at a value that inputs like those of the calibration rarely exceed. It may be changed "
        "between communication steps.",
        "largest 95 % error bound with which `trusted` is true",
        "parameter",
        "tunable",
        per="output",
        when="bound",
        bounds=(0.0, None, "surrogate"),
    ),
    VariableKind(
        22,
        "TRUSTED",
        TRUSTED,
        "It is false when this step may be wrong: a 95 % error bound exceeds its tolerance "
        "(whatever confidence is), in_domain or a range is false, or error_bound_filled is below "
        "1. It costs time only when it is read.",
        "if false, this step may be wrong, by bound, domain, ranges or an unknown past",
        "output",
        "discrete",
        type="Boolean",
        when="bound",
        initially="everything",
    ),
    VariableKind(
        23,
        "INPUTS_HELD",
        HELD,
        "With 0, the FMU tells by what it has seen of an input whether it moves smoothly, so that "
        "it goes on within a communication step, or is held, as a controller does; with 1, all "
        "inputs are held over each step.",
        "0: smooth inputs move on within a step, others are held; 1: all are held",
        "parameter",
        "fixed",
        when="zero_order",
        unit="1",
        bounds=(0.0, 1.0, 0.0),
    ),
    VariableKind(
        24,
        "INITIAL_OUTPUT_WINDOW",
        f"{INITIAL}_window",
        f"These were the last {{size}} samples of {{signal}} before the start, oldest first, as "
        f"measured, where {PREHISTORY_KNOWN} is 3; NaN where it is not known. Inputs before the "
        "first known output do not count.",
        "last measured outputs before the start, oldest first; NaN where not known",
        "parameter",
        "fixed",
        per="output",
        when="known_start",
        size="sampled",
        fmi=3,
        bounds=(None, None, math.nan),
    ),
)
"""All kinds in rising order of their numbers, which is their order in a model description."""

BY_KEY = {kind.key: kind for kind in KINDS}


def known_inputs(names: Collection[str]) -> str:
    """Return the parameter that tells an FMU with these variables that its inputs are known.

    With 1, nothing is forecast: inputs of first-order hold are set to what they reach by the end
    of a step, those of zero-order hold are held over it.
    """
    return AT_STEP_END if AT_STEP_END in names else HELD
