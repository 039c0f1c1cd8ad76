"""This module defines the recipe's tables of network families and their training.

A network family is added by its table, the table of its training, and its place in
``NetworkTable``, ``TrainingTable`` and ``METHODS`` at the end; no other module of this room names
the families.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, PlainValidator, field_validator, model_validator

from slide_fmu.core.toml_table import Table as Table
from slide_fmu.excitation.kinds import Excitation
from slide_fmu.features.sets import LINEAR_NAMES

PositiveInt = Annotated[int, Field(gt=0)]
NonNegativeInt = Annotated[int, Field(ge=0)]
FeatureNames = Annotated[tuple[str, ...], Field(min_length=1)]
PositiveFloat = Annotated[float, Field(gt=0, allow_inf_nan=False)]


def _require_odd(names: tuple[str, ...], readout: tuple[str, ...] = ()) -> None:
    """Refuse a network without biases that is not odd."""
    others = [name for name in names if name not in LINEAR_NAMES]
    if others or readout:
        more = f" and readout = {list(readout)}" if readout else ""
        raise ValueError(
            f"bias = false with the features {list(names)}{more}; expected true, or features "
            f"out of {', '.join(LINEAR_NAMES)} without a readout: only then does the network "
            "answer -u with -y"
        )


class FeedForwardRecipe(Table):
    """The table ``network`` describes the paper's feed-forward network.

    Attributes:
        LEARNS_BEYOND: whether its fit uses trajectories beyond the range (``data.beyond``).
        FOLLOWS_PARAMETERS: whether its weights may follow physical parameters (``parameters``).
        family: name of the network family.
        hidden: widths of the hidden layers; empty for one affine map.
        activation: activation of the hidden layers.
        bias: whether layers have biases; without, odd activations give an odd network: for
            features that change their sign with the inputs.
        linear_skip: whether a linear path leads from the inputs to the outputs.
        time_invariant: whether one network serves every position of the output window and sees the
            n_in - n_out + 1 inputs before it; else one network gives the whole block.
        features: names of the features that it sees (``slide_fmu.features.sets``).
    """

    LEARNS_BEYOND: ClassVar[bool] = False
    FOLLOWS_PARAMETERS: ClassVar[bool] = False
    family: Literal["feed_forward"]
    hidden: tuple[PositiveInt, ...]
    activation: Literal["identity", "relu", "elu", "tanh", "gelu", "cubic"] = "relu"
    bias: bool = True
    linear_skip: bool = False
    time_invariant: bool = False
    features: FeatureNames = ("inputs",)

    @model_validator(mode="after")
    def _odd_without_bias(self) -> FeedForwardRecipe:
        if not self.bias:
            _require_odd(self.features)
        return self

    def feature_names(self) -> tuple[str, ...]:
        """Return the names of all features that it uses."""
        return self.features

    @property
    def sees_whole_window(self) -> bool:
        """Tell whether every output depends on all n_in inputs of the window, by form alone."""
        return not self.time_invariant


def _size_from(least: int) -> Callable[[Any], Any]:
    """Return the check of a size that may also be found automatically."""

    def check(value: Any) -> Any:
        number = isinstance(value, int) and not isinstance(value, bool) and value >= least
        if not (number or value == "auto"):
            raise ValueError(f"expected a whole number from {least}, or 'auto'")
        return value

    return check


class StateSpaceRecipe(Table):
    """The table ``network`` describes the nonlinear state-space network, run from zero state.

    Attributes:
        LEARNS_BEYOND: whether its fit uses trajectories beyond the range (``data.beyond``).
        FOLLOWS_PARAMETERS: whether its weights may follow physical parameters (``parameters``).
        family: name of the network family.
        order: number of states that carry the response; ``"auto"``: from the eigenvalues of the
            linearized system in the excited band (else from what the past tells of the future),
            raised while the validation error falls.
        hidden: number of hidden units; 0 for a linear network; ``"auto"``: raised likewise.
        padding: states that are added to the order for the hidden units.
        units: activation of the hidden units. Cubic units suit polynomial springs, but may grow
            without end beyond the trained range. Mixed units are tanh and clipped cubes in turns:
            bounded, and more accurate just beyond the range where springs harden. ``"auto"``:
            tanh or, without padding, mixed or cubic, by trials in which the largest amplitudes
            are held out; with ``hidden = "auto"`` these find the number of cubes and the
            sub-steps too. Gated units (LPV units, linear parameter-varying) make the response
            linear, with coefficients that follow scheduling variables: for mechanisms whose
            inertia depends on their configuration.
        substeps: number of steps that the states take in every sample. If a sample is long for a
            hardening spring, a few cubes that act several times are more accurate than many cubes
            that act once, also beyond the range.
        bias: whether there are constant terms. Without them the network answers -u with -y; this
            is for features that change their sign with the inputs, and no readout.
        drive: names of the features in the state input (``slide_fmu.features.sets``). ``"auto"``
            (the default) takes the inputs. Where there are angles or a serial chain, and no other
            features are named, it takes the choice of all features with the best validation error.
        static: names of the features in the feedthrough, which the outputs follow at once; as the
            drive if not given.
        gated: names of the features that LPV units multiply, as they multiply the states; as the
            drive if not given.
        schedule: names of the scheduling variables, which open and close LPV units.
        readout: names of factors of the outputs, such as the lever arm of a rotation.
        turned_pairs: pairs of states that LPV units see in the turned frame of the features.
        parameter_degree: total degree of the polynomials by which the weights follow physical
            parameters; for records of few specimens 1 if not given.
    """

    LEARNS_BEYOND: ClassVar[bool] = True
    FOLLOWS_PARAMETERS: ClassVar[bool] = True
    family: Literal["state_space"] = "state_space"
    order: Annotated[int | Literal["auto"], PlainValidator(_size_from(1))] = "auto"
    hidden: Annotated[int | Literal["auto"], PlainValidator(_size_from(0))] = "auto"
    padding: int = Field(default=2, ge=0)
    units: Literal["tanh", "cubic", "mixed", "gated", "auto"] = "tanh"
    substeps: int = Field(default=1, ge=1, le=16)
    bias: bool = True
    drive: FeatureNames | None = None
    static: FeatureNames | None = None
    gated: FeatureNames | None = None
    schedule: tuple[str, ...] = ()
    readout: tuple[str, ...] = ()
    turned_pairs: int = Field(default=0, ge=0)
    parameter_degree: int = Field(default=2, ge=1, le=8)

    @property
    def may_have_states_of_the_system(self) -> bool:
        """Whether the network can have the states of its system, where these are known."""
        special = self.gated or self.schedule or self.readout or self.turned_pairs
        plain = self.units in ("tanh", "auto") and self.bias and self.substeps == 1
        return plain and not special

    @field_validator("drive", mode="before")
    @classmethod
    def _auto_is_none(cls, value: Any) -> Any:
        return None if value == "auto" else value

    @model_validator(mode="after")
    def _gated_units_have_a_schedule(self) -> StateSpaceRecipe:
        gated = self.units == "gated"
        if gated != bool(self.schedule):
            raise ValueError(
                f"units = {self.units!r} with schedule = {list(self.schedule)}; expected a "
                "schedule for gated units, and for them alone"
            )
        if not gated and (self.gated is not None or self.turned_pairs):
            seen = None if self.gated is None else list(self.gated)
            raise ValueError(
                f"units = {self.units!r} with gated = {seen}, turned_pairs = "
                f"{self.turned_pairs}; expected neither without gated units"
            )
        if gated and self.substeps > 1:
            raise ValueError(f"substeps = {self.substeps} with gated units; expected 1")
        if gated and not self.bias:
            raise ValueError("bias = false with gated units; expected true")
        if not self.bias:
            _require_odd(self.feature_names(), self.readout)
        return self

    def roles(self) -> dict[str, tuple[str, ...]]:
        """Return the names of the features in each of a cell's ``Roles``; "auto" as the inputs."""
        gated, drive = self.units == "gated", self.drive or ("inputs",)
        return {
            "drive": drive,
            "static": drive if self.static is None else self.static,
            "gated": (drive if self.gated is None else self.gated) if gated else (),
            "schedule": self.schedule,
            "readout": self.readout,
            "turn": ("frame",) if self.turned_pairs else (),
        }

    @property
    def roles_are_named(self) -> bool:
        """Tell whether the recipe names the features of any part of the network."""
        others = (self.static, self.gated, self.schedule, self.readout)
        return self.drive is not None or any(others)

    def feature_names(self) -> tuple[str, ...]:
        """Return the names of all features that it uses, each once."""
        return tuple(dict.fromkeys(name for names in self.roles().values() for name in names))

    @property
    def sees_whole_window(self) -> bool:
        """Tell whether every output depends on all n_in inputs: only the newest does."""
        return False


class LeastSquaresExpert(Table):
    """The table ``training.expert`` tunes Levenberg-Marquardt; the defaults suit most systems.

    Attributes:
        segment: approximate number of scored samples of a segment of a trajectory. If not given,
            256 or the samples that the window truncates, if they are more; these come before the
            scored ones. Where a part of the data is learnt from and the window truncates more
            than 512 samples, a quarter of these, but no fewer than 256, is scored.
        part: every ``part``-th segment makes the data of the starts, or fewer of very many.
        start_iterations: iterations of each start.
        kept: best starts by validation that go on.
        kept_iterations: iterations of each of them, on the same data.
        dense_limit: largest number of parameters for which normal equations are solved in every
            iteration; a larger network is widened from the best start of half that size and
            refined on all data by preconditioned gradient steps.
        refinements: number of those refinements, 80 steps each.
        beyond_weight: factor on the residuals of trajectories beyond the range.
        even_out: whether segments that move more than usual get lower weights.
        precision: floating point format of the training.
        excitation: further kinds of excitation, for example faster motions than the FMU is for.
            Networks and the scale of the error bound learn from them, in one mix with
            ``data.excitation``. The bound is not calibrated by them, and the FMU is not measured
            on them.
    """

    segment: PositiveInt | None = None
    part: PositiveInt = 5
    start_iterations: PositiveInt = 20
    kept: PositiveInt = 3
    kept_iterations: PositiveInt = 40
    dense_limit: PositiveInt = 3000
    refinements: PositiveInt = 60
    beyond_weight: PositiveFloat = 0.1
    even_out: bool = False
    precision: Literal["float32", "float64"] = "float64"
    excitation: tuple[Excitation, ...] = ()


class LeastSquaresRecipe(Table):
    """The table ``training`` describes Levenberg-Marquardt: a multi-start with successive halving.

    Attributes:
        method: name of the training; it follows from the network's family and is no key of a
            file.
        seed: seed of the starts.
        starts: number of random starts; a fit from known states of a function has one.
        iterations: most iterations of the best of them, on all data, or on some segments of very
            many. A fit ends earlier where its validation error no longer falls.
        start: path of an FMU of slide-fmu whose network the training begins with: for example one
            that was learnt from a simulation and is refined on a record, or at one value of
            physical parameters and is to follow them. Then there is no search, and the FMU gives
            the table ``network`` except for ``parameter_degree``. With an error bound, the
            companion begins with the companion of that FMU, without a search as well.
        expert: settings for users who know the method.
    """

    method: Literal["levenberg_marquardt"] = Field(default="levenberg_marquardt", repr=False)
    seed: int = Field(default=0, ge=0, lt=2**31)
    starts: PositiveInt = 8
    iterations: PositiveInt = 60
    start: str | None = None
    expert: LeastSquaresExpert = LeastSquaresExpert()

    def search_iterations(self, starts: int, kept: int) -> int:
        """Return the iterations of this number of starts, and of the candidates that are kept."""
        return starts * self.expert.start_iterations + kept * self.expert.kept_iterations

    @property
    def flips_signs(self) -> bool:
        """Tell whether data is shown with both signs: only Adam can."""
        return False


class AdamExpert(Table):
    """The table ``training.expert`` tunes Adam; the defaults suit most systems.

    Attributes:
        final_learning_rate: fraction of ``learning_rate`` that is left at the end.
        warm_up: fraction of the steps in which the learning rate rises.
        weight_decay: decoupled weight decay.
        gradient_clip: largest norm of the gradient; longer ones are shortened to it.
        flip_signs: whether windows are shown with both signs, for systems that answer -u with -y.
        input_jitter: standard deviation of noise on the features, as scaled for the network.
        validate_every: steps between validations and checkpoints.
        precision: floating point format of the training.
    """

    final_learning_rate: float = Field(default=0.0, ge=0, le=1)
    warm_up: float = Field(default=0.05, ge=0, lt=1)
    weight_decay: float = Field(default=0.0, ge=0, allow_inf_nan=False)
    gradient_clip: PositiveFloat | None = None
    flip_signs: bool = False
    input_jitter: float = Field(default=0.0, ge=0, allow_inf_nan=False)
    validate_every: PositiveInt = 500
    precision: Literal["float32", "float64"] = "float32"


class TrainingRecipe(Table):
    """The table ``training`` describes Adam with a warm-up and a cosine schedule.

    Attributes:
        method: name of the training; it follows from the network's family and is no key of a
            file.
        seed: seed of initialisation and of the order of the windows.
        steps: number of steps of the optimizer.
        batch: windows per step.
        learning_rate: highest learning rate.
        expert: settings for users who know the method.
    """

    method: Literal["adam"] = Field(default="adam", repr=False)
    seed: int = Field(default=0, ge=0, lt=2**31)
    steps: PositiveInt
    batch: PositiveInt
    learning_rate: PositiveFloat
    expert: AdamExpert = AdamExpert()

    @property
    def flips_signs(self) -> bool:
        """Tell whether windows are shown with both signs."""
        return self.expert.flip_signs


NetworkTable = Annotated[FeedForwardRecipe | StateSpaceRecipe, Field(discriminator="family")]
"""The table of any network family."""
TrainingTable = Annotated[TrainingRecipe | LeastSquaresRecipe, Field(discriminator="method")]
"""The table of any training."""
METHODS = {"feed_forward": "adam", "state_space": "levenberg_marquardt"}
"""Training method of each network family."""
