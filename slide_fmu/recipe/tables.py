"""This module defines the recipe's tables of window, data, and tests of a surrogate."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from slide_fmu.core.window import Window
from slide_fmu.excitation.base import PositiveRange
from slide_fmu.excitation.kinds import Excitation
from slide_fmu.network.state_space.cell import MOST_SUBSTEPS
from slide_fmu.recipe.automatic import LEAST_CALIBRATION
from slide_fmu.recipe.learning import PositiveFloat, PositiveInt, Table

Part = Literal[
    "train", "validation", "estimator", "estimator_validation", "bound", "calibration", "test"
]
"""Uses of a part of measured records, in the order of time."""


class WindowRecipe(Table):
    """The table ``window`` gives the inputs that the network sees, and the outputs that it gives.

    Attributes:
        step: sample step h in s.
        n_in: number of input samples; found from the decay time if ``"auto"`` or not given.
        n_out: number of output samples; follows ``n_in`` if ``"auto"`` or not given.
        planned: whether inputs with a first-order hold are planned motions, which are known ahead
            and move between samples as the model moves them. ``slide_fmu.simulate``, ``slide-fmu
            motion`` and SSPs then give the FMU the values that they reach by each step's end.
        remaining_amplitude: fraction to which initial effects must have decayed; recipes of
            ``init`` have 0.001.
        allow_short: whether a window is accepted that is too short for the system.
    """

    step: PositiveFloat
    n_in: PositiveInt
    n_out: PositiveInt
    planned: bool = False
    remaining_amplitude: float = Field(0.01, gt=0, lt=1)
    allow_short: bool = False

    @model_validator(mode="after")
    def _fits(self) -> WindowRecipe:
        if self.n_out > self.n_in:
            raise ValueError(f"n_out = {self.n_out}; expected at most n_in = {self.n_in}")
        return self

    @property
    def as_window(self) -> Window:
        """The window that has these lengths."""
        return Window(self.step, self.n_in, self.n_out)


class DataRecipe(Table):
    """The table ``data`` describes the trajectories and their excitation.

    Attributes:
        seed: entropy of every trajectory's own seed.
        duration: length of a trajectory in s, after the burn-in; from the window if ``"auto"`` or
            not given.
        substeps: parts of a sample step at which the model gets moving inputs, where a kind of
            excitation bends between samples, as sines do. With 1 inputs go straight from sample to
            sample, and the network does not learn the effect of bending.
        jumps: whether moving inputs may jump between samples, at any time. Kinds of excitation
            that change at once (``steps``, ``held_random``, ``binary``, ``stops``) then jump where
            a bound is learnt and calibrated, and in the validation: in half of the motions when a
            sample is taken. Networks learn from straight lines within one step: the time of a jump
            would be noise to them. Without the key, all go straight, and the bound knows nothing
            of inputs that jump. Held inputs jump at samples always. Motions in a ``[[loop]]`` do
            not jump.
        burn_in: time in s that a random initial state is given to decay; not stored; one window
            if ``"auto"`` or not given.
        train, validation: numbers of trajectories. If ``"auto"`` or not given, 256 to learn from
            where one process simulates them in 20 s, else 64 of a function whose states
            the network may have, and as many as a learning curve finds of other models.
        estimator, estimator_validation: numbers for the error estimator, if there is one;
            likewise.
        companion, bound, calibration: numbers of trajectories of the error bound, if there is one
            (table ``bound``). For the companion, 0 stands for the number ``train``, and
            ``"train"`` for the surrogate's own trajectories. Bounds with a confidence of 0.99 need
            at least 100 for the calibration. If ``"auto"``, or if they and ``train`` are not
            given, they follow from the time that a simulation takes.
        beyond: number of trajectories whose inputs leave their declared ranges, which are hard
            limits otherwise. A state-space network also learns from them, with a low weight, to
            stay sensible there.
        beyond_factor: range of the factor on their excitation.
        most_failures: part of all trajectories that may fail to be simulated; another draw takes
            the place of each. One is always allowed.
        excitation: kinds of excitation with their weights; a mix that follows from the step if
            not given. Records have no excitation.
        shares: for records, the share of all samples for each part (``Part``); defaults if not
            given.
        by: for records, how they are divided: by contiguous ``"block"`` in the order of time, of
            all files end to end; likewise of ``"each"`` file by itself (the default with physical
            parameters); or by whole ``"record"``. Samples of the same inputs are in one part.
        blocks: for records, the number of blocks that each part has, spread over the records. If
            not given, up to five, each as long as the memory of the machine. With 1 each part is
            one stretch: training first, test last.
    """

    seed: int = Field(default=0, ge=0)
    duration: PositiveFloat
    burn_in: float = Field(ge=0, allow_inf_nan=False)
    substeps: int = Field(1, ge=1, le=MOST_SUBSTEPS)
    jumps: bool = False
    train: PositiveInt
    validation: PositiveInt
    estimator: int = Field(0, ge=0)
    estimator_validation: int = Field(0, ge=0)
    companion: Annotated[int, Field(ge=0)] | Literal["train"] = 0
    bound: int = Field(100, ge=2)
    calibration: int = Field(200, ge=LEAST_CALIBRATION)
    beyond: int = Field(default=0, ge=0)
    beyond_factor: PositiveRange = (1.0, 3.0)
    most_failures: float = Field(default=0.02, ge=0, le=1)
    excitation: tuple[Excitation, ...] = ()
    shares: dict[Part, Annotated[float, Field(ge=0, le=1)]] = Field(default={})
    by: Literal["block", "each", "record"] = "block"
    blocks: PositiveInt | None = None


class ValidationRecipe(Table):
    """The table ``validation`` describes unseen trajectories on which an FMU is measured.

    Attributes:
        trajectories: number of unseen trajectories, in which all kinds of the mix take turns. If
            not given, 12 of each kind, by which a kind can be judged, or as many of each as can be
            simulated in a minute. Rows of further inputs have as many motions of each kind, but 12
            at most.
        duration: length of each in s, after the burn-in. If not given, one and a half input
            windows, or more where these are less than 1000 samples or the error bound is filled
            later, but no more than in the training data.
        excitation: kinds of excitation that are held out: they are not used for learning or
            calibration, and the FMU is measured on them separately.
        require: largest relative RMSE of an output on unseen trajectories in range (0.05 is 5 %).
            ``slide-fmu run`` fails where the error is larger.
        adversarial: number of unseen trajectories from which a search for large errors relative to
            their bounds begins. Each takes about a minute.
    """

    trajectories: PositiveInt | None = None
    duration: PositiveFloat | None = None
    excitation: tuple[Excitation, ...] = ()
    require: Annotated[PositiveFloat, Field(le=1.0)] | None = None
    adversarial: int = Field(default=0, ge=0)


class StabilityRecipe(Table):
    """The table ``stability`` sets tests that a state-space network must pass before its export.

    Attributes:
        amplitudes: factors on the trained amplitude at which it is tested.
        contraction_beyond: fading memory beyond the trained amplitude. It is the largest
            difference allowed between two runs from different states after one window, over the
            output's standard deviation. The median run counts, since systems may have several
            lasting responses there.
        allow_unstable: whether a network that fails is exported nevertheless.
    """

    amplitudes: tuple[PositiveFloat, ...] = Field(default=(1.0, 2.0, 4.0, 10.0), min_length=1)
    contraction_beyond: PositiveFloat = 0.5
    allow_unstable: bool = False
