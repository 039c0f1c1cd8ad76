"""The surrogate: the only thing that crosses from learning to export. Needs numpy alone."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.files import write_whole
from slide_fmu.core.parameters import Parameter, checked_values
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray, Hold, Signal, cosines_of, hold_of
from slide_fmu.core.window import Window
from slide_fmu.features.base import BEFORE
from slide_fmu.network.base import BATCH, Network, Parametric, batches
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.checks import (
    check_bound,
    check_forecast,
    check_signals,
    check_starts,
    checked_inputs,
    in_ranges,
    inside_throughout,
)
from slide_fmu.surrogate.error_bound import USUAL_CONFIDENCE, ErrorBound, Trust
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.input_forecast import InputForecast
from slide_fmu.surrogate.payload import decode, encode


@dataclass(frozen=True, eq=False)
class Surrogate:
    """A Surrogate stands in for a system: it has window, scalings, network, error estimator.

    Attributes:
        name: C identifier; name of the FMU.
        window: the index law.
        inputs: input signals, in channel order; their ranges, holds and angles are those of the
            training, and their start values lie in offset -+ scale of the scaling.
        outputs: output signals, in channel order.
        input_scaling: physical inputs to network inputs.
        output_scaling: physical outputs to network outputs.
        network: scaled input window to scaled outputs; its weights may follow physical parameters,
            which then have their start values unless others are given.
        estimator: error estimator, or None.
        forecast: how inputs with a first-order hold go on, and whether the FMU asks for that; None
            with a zero-order hold, and where inputs are set to what they reach by the step's end.
        bound: error bound of a state-space network without parameters, or None.

    Raises:
        ValueError: the parts do not fit together.
    """

    name: str
    window: Window
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    input_scaling: Affine
    output_scaling: Affine
    network: Network
    estimator: ErrorEstimator | None = None
    forecast: InputForecast | None = None
    bound: ErrorBound | None = None
    output_ranges: FloatArray | None = None

    def __post_init__(self) -> None:
        if not (self.name.isascii() and self.name.isidentifier()):
            raise ValueError(
                f"surrogate name {self.name!r}; expected letters, digits and underscores, "
                "not beginning with a digit (it becomes the FMU's model identifier)"
            )
        self._check_channels()
        check_signals(self.inputs, self.outputs, self.input_scaling)
        check_starts(self.input_scaling, self.inputs)
        self.network.require_window(self.window, len(self.outputs))
        if self.estimator is not None:
            self.estimator.require_outputs(len(self.outputs))
        if self.bound is not None:
            fits = isinstance(self.network, StateSpace) and not self.parameters
            check_bound(self.name, self.bound, fits, self.estimator)
            self.bound.companion.require_window(self.window, len(self.outputs))
        check_forecast(self.forecast, self.inputs)
        self._check_output_ranges()

    def _check_output_ranges(self) -> None:
        ranges, expected = self.output_ranges, (len(self.outputs), 2)
        if ranges is not None and not (
            ranges.shape == expected
            and np.isfinite(ranges).all()
            and (ranges[:, 0] <= ranges[:, 1]).all()
        ):
            raise ValueError(
                f"output_ranges {ranges.tolist()}; expected the finite lower and upper end for "
                f"each output, shape {expected}"
            )

    def _check_channels(self) -> None:
        networks = [self.network, *([] if self.estimator is None else [self.estimator.network])]
        networks += [] if self.bound is None else [self.bound.companion]
        inputs = {len(self.input_scaling.scale), *(network.n_channels for network in networks)}
        if inputs != {len(self.inputs)} or len(self.output_scaling.scale) != len(self.outputs):
            raise ValueError(
                f"{len(self.inputs)} inputs and {len(self.outputs)} outputs, but networks and "
                f"scaling for {sorted(inputs)} inputs and {len(self.output_scaling.scale)} outputs"
            )
        wanted = {i for network in networks for i in network.features.features.cosines}
        if not wanted <= set(cosines_of(self.inputs)):
            raise ValueError(
                f"inputs {[signal.name for signal in self.inputs]} are no angle, but a network "
                "sees features of one; expected a signal with angle 'cosine' and one with 'sine'"
            )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return the physical parameters that users may set, in their order; none of most."""
        return self.network.parameters if isinstance(self.network, Parametric) else ()

    def at(self, parameters: Mapping[str, float]) -> Surrogate:
        """Return the surrogate for fixed values of its parameters; it has none any more.

        Args:
            parameters: values by name, in the parameters' units; those that are not given have
                their start values.

        Raises:
            ValueError: a name is that of no parameter, or a value lies outside its range.
        """
        values = checked_values(self.parameters, parameters)
        if not isinstance(self.network, Parametric) or len(values) == 0:
            return self
        return dataclasses.replace(self, network=self.network.at(values))

    def starting_at(self, parameters: Mapping[str, float]) -> Surrogate:
        """Return the surrogate with other start values of its parameters, by name.

        Those that are not given keep theirs.

        Raises:
            ValueError: as for ``at``.
        """
        values = checked_values(self.parameters, parameters)
        if not isinstance(self.network, Parametric):
            return self
        return dataclasses.replace(self, network=self.network.starting_at(values))

    @property
    def hold(self) -> Hold:
        """Return the hold of the inputs between samples, as in the training data."""
        return hold_of(self.inputs)

    @property
    def inputs_at_step_end(self) -> bool:
        """Say whether the FMU starts with inputs that count as reached by the step's end."""
        return self.forecast is not None and self.forecast.at_step_end

    @property
    def planned(self) -> bool:
        """Say whether the inputs are planned motions, known ahead, with curves of their own."""
        return self.forecast is not None and self.forecast.planned

    def reaching_inputs_by_step_end(self) -> Surrogate:
        """Return the surrogate whose FMU starts with ``inputs_at_step_end`` = 1.

        One whose inputs have a zero-order hold has no such parameter and is returned as it is.
        """
        if self.hold == "zero_order":
            return self
        count = len(self.inputs)
        without = InputForecast(weights=np.zeros((count, 0, 1)), largest_change=np.zeros(count))
        forecast = dataclasses.replace(self.forecast or without, at_step_end=True)
        return dataclasses.replace(self, forecast=forecast)

    @property
    def starts(self) -> FloatArray:
        """Return the inputs before anybody sets them, in their units, shape (n_inputs,)."""
        return np.array([signal.start_value for signal in self.inputs], dtype=np.float64)

    @property
    def memory_length(self) -> int:
        """Return the number of samples of the inputs that any result may depend on.

        It is the longest of the input window and the memories of error estimator and error bound,
        and before them the ``BEFORE`` samples that features look at. The C runtime has it as
        ``memory_length`` too.
        """
        others = [part.memory_length for part in (self.estimator, self.bound) if part is not None]
        return max(self.window.n_in, *others, 0) + BEFORE

    @property
    def estimates_errors(self) -> bool:
        """Say whether ``estimate_error`` gives something: by an estimator, or by its bound."""
        return self.estimator is not None or (
            self.bound is not None and self.bound.span is not None
        )

    @property
    def estimated_samples(self) -> int:
        """Return over how many samples the error is estimated; else the output window's."""
        estimator, window = self.estimator, self.window
        if self.bound is not None and self.bound.span is not None:
            return self.bound.span.samples
        if estimator is None or (estimator.network.n_samples, estimator.positions) == (
            window.n_in,
            1,
        ):
            return window.n_out
        return estimator.positions

    def predict_windows(self, windows: NDArray[Any]) -> FloatArray:
        """Predict the outputs of single windows.

        Args:
            windows: physical inputs, shape (B, n_in, n_inputs).

        Returns:
            Outputs, shape (B, n_out, n_outputs), in the outputs' units.
        """
        values = self.network.block(self.input_scaling.apply(windows), self.window.n_out)
        return self.output_scaling.invert(values.astype(np.float64))

    def predict(
        self, inputs: NDArray[Any], parameters: Mapping[str, float] | None = None
    ) -> FloatArray:
        """Predict over a long record in blocks of n_out samples (paper: stride n_out).

        Before the record the first input is taken as held.

        Args:
            inputs: shape (N, n_inputs), N >= 1, in the inputs' units.
            parameters: values by name, as for ``at``; the start values if None.

        Returns:
            Outputs at samples 1 .. N, shape (N, n_outputs).

        Raises:
            ValueError: wrong number of channels, no samples, values that are not finite, or bad
                parameters as in ``at``.
        """
        return self.in_blocks(inputs, self.at(parameters or {}).predict_windows)

    def in_blocks(
        self, inputs: NDArray[Any], evaluate: Callable[[FloatArray], FloatArray]
    ) -> FloatArray:
        """Evaluate a long record in blocks of n_out samples, as ``predict`` does.

        Args:
            inputs: as for ``predict``.
            evaluate: from windows of it, shape (B, n_in, n_inputs), to values of any kind at the
                samples of their output windows, shape (B, n_out, ...).

        Returns:
            The values at samples 1 .. N, shape (N, ...).

        Raises:
            ValueError: as for ``predict``.
        """
        checked = checked_inputs(inputs, self.inputs)
        n_out, count = self.window.n_out, len(checked)
        blocks = -(-count // n_out)
        lead = blocks * n_out - count
        prehistory = np.repeat(checked[:1], lead + self.window.n_truncated, axis=0)
        padded = np.concatenate([prehistory, checked])
        starts = np.arange(blocks) * n_out
        parts = [
            evaluate(padded[self.window.input_indices(starts[some])])
            for some in batches(blocks, BATCH)
        ]
        values = np.concatenate(parts)
        return values.reshape(blocks * n_out, *values.shape[2:])[lead:]

    def predict_newest(
        self, inputs: NDArray[Any], parameters: Mapping[str, float] | None = None
    ) -> FloatArray:
        """Predict a long record as a co-simulation does: the newest output of every step.

        Args:
            inputs: record of the inputs in their units, shape (N, n_inputs).
            parameters: values of the physical parameters by name; start values for others.

        Returns:
            Outputs at samples 1 .. N, shape (N, n_outputs).

        Raises:
            ValueError: as for ``predict``.
        """
        checked = checked_inputs(inputs, self.inputs)[None]
        return np.asarray(self.predict_newest_batch(checked, parameters)[0])

    def predict_newest_batch(
        self, inputs: NDArray[Any], parameters: Mapping[str, float] | None = None
    ) -> FloatArray:
        """Predict many records of the same length by ``predict_newest``.

        Inputs of the shape (B, N, n_inputs) give outputs (B, N, n_outputs).
        """
        checked, network = checked_inputs(inputs, self.inputs, "records, "), self.network
        if parameters:
            network = self.at(parameters).network
        values = network.stream(self.input_scaling.apply(checked))
        newest = values[:, :, -len(self.outputs) :].astype(np.float64)
        return self.output_scaling.invert(newest)

    def estimate_error(self, inputs: NDArray[Any]) -> FloatArray:
        """Estimate the RMSE over the ``estimated_samples`` that end at each sample.

        Of a surrogate with parameters it is the usual one over all their values.

        Args:
            inputs: shape (N, n_inputs), N >= 1, in the inputs' units.

        Returns:
            Estimates at samples 1 .. N, shape (N, n_outputs), in the outputs' units.

        Raises:
            ValueError: there is no error estimate, or bad inputs as in ``predict``.
        """
        if not self.estimates_errors:
            raise ValueError(
                f"surrogate {self.name!r} has no error estimator; train one, by the recipe's "
                "table [estimator], or by bound.estimate_span"
            )
        scaled = self.input_scaling.apply(checked_inputs(inputs, self.inputs))
        if self.estimator is not None:
            relative = self.estimator.estimates(scaled, len(self.outputs))
        else:
            assert self.bound is not None
            predicted = self.network.stream(scaled[None]).astype(np.float64)
            relative = self.bound.estimates(scaled[None], predicted)[0]
        return np.asarray(relative * self.output_scaling.scale)

    def trust(self, inputs: NDArray[Any]) -> Trust:
        """Give the local scale of the error, the disagreement and the novelty of every sample.

        Args:
            inputs: shape (N, n_inputs), N >= 1, in the inputs' units.

        Raises:
            ValueError: there is no error bound, or bad inputs as in ``predict``.
        """
        bound = self._required_bound()
        return self._trusts(bound, checked_inputs(inputs, self.inputs)[None])[0]

    def _required_bound(self) -> ErrorBound:
        if self.bound is None:
            raise ValueError(
                f"surrogate {self.name!r} has no error bound; train one: the recipe's table "
                "[bound]"
            )
        return self.bound

    def _trusts(self, bound: ErrorBound, records: FloatArray) -> list[Trust]:
        scaled = self.input_scaling.apply(records)
        return bound.along(scaled, self.network.stream(scaled).astype(np.float64))

    def error_bounds(
        self, inputs: NDArray[Any], confidence: float = USUAL_CONFIDENCE
    ) -> FloatArray:
        """Give what the error of each sample stays below, with a confidence of 0.9 to 0.99.

        Args:
            inputs: as for ``trust``.
            confidence: the share of samples of a trajectory of the calibrated kinds that is
                covered on average; the next calibrated one above it counts.

        Returns:
            Bounds at samples 1 .. N, shape (N, n_outputs), in the outputs' units.

        Raises:
            ValueError: as for ``trust``, or a confidence that is not calibrated.
        """
        return self._bounds(self.trust(inputs), inputs, confidence)[0]

    def error_bounds_and_domain(
        self, records: NDArray[Any]
    ) -> list[tuple[FloatArray, NDArray[np.bool_]]]:
        """Give what ``error_bounds`` and ``in_domain`` give of B records, for the price of one.

        The confidence is the usual one.

        Args:
            records: inputs as for ``trust``, with an axis of the records before: shape
                (B, N, n_inputs).

        Returns:
            Bounds (N, n_outputs), and the samples that are in the domain, (N,), of each record.

        Raises:
            ValueError: as for ``error_bounds``.
        """
        bound = self._required_bound()
        checked = checked_inputs(records, self.inputs, "records, ")
        trusts = zip(self._trusts(bound, checked), checked, strict=True)
        return [self._bounds(trust, one, USUAL_CONFIDENCE) for trust, one in trusts]

    def _bounds(
        self, trust: Trust, inputs: NDArray[Any], confidence: float
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        assert self.bound is not None
        inside = self._known(trust, inputs)
        return self.bound.bounds(trust, confidence, inside) * self.output_scaling.scale, inside

    def in_domain(self, inputs: NDArray[Any]) -> NDArray[np.bool_]:
        """Say at each sample whether the surrogate knows such inputs: (N, n_inputs) to (N,).

        The novelty is at most 1, and the inputs lie in their ranges (``inputs_in_range``).

        Raises:
            ValueError: as for ``trust``.
        """
        return self._known(self.trust(inputs), inputs)

    def _known(self, trust: Trust, inputs: NDArray[Any]) -> NDArray[np.bool_]:
        return np.asarray((trust.novelty <= 1) & self.inputs_in_range(inputs))

    def inputs_in_range(self, inputs: NDArray[Any]) -> NDArray[np.bool_]:
        """Say at each sample whether inputs behind the outputs are known: (N, n_inputs) to (N,).

        The last ``network.memory_length`` inputs must lie in their ranges, the first counting as
        held for ever before; of an angle, the length of cosine and sine must be about 1.

        Raises:
            ValueError: as for ``predict``.
        """
        scaled = self.input_scaling.apply(checked_inputs(inputs, self.inputs))
        return inside_throughout(in_ranges(self.inputs, scaled), self.network.memory_length)

    def outputs_in_range(self, outputs: FloatArray) -> NDArray[np.bool_]:
        """Say of outputs, (N, n_outputs), whether all lie where the training had them, (N,).

        Raises:
            ValueError: nobody knows the ranges of the training.
        """
        if self.output_ranges is None:
            raise ValueError("the ranges of the outputs in the training are not known")
        low, high = self.output_ranges.T
        return np.asarray(np.all((outputs >= low) & (outputs <= high), axis=1))

    def truncation_errors(self, inputs: NDArray[Any]) -> FloatArray | None:
        """Give what the finite memory was last found to cost each output, at each sample.

        Inputs (N, n_inputs) give (N, n_outputs), in the outputs' units; None for networks that
        do not measure it.

        Raises:
            ValueError: as for ``predict``.
        """
        scaled = self.input_scaling.apply(checked_inputs(inputs, self.inputs))
        if not isinstance(self.network, StateSpace):
            return None
        _, errors = self.network.ping_pong(scaled[None])
        return np.asarray(errors[0].astype(np.float64) * self.output_scaling.scale)

    def to_bytes(self) -> bytes:
        """Write a surrogate file (``payload.py``); the same surrogate gives the same bytes."""
        return encode(self)

    @staticmethod
    def from_bytes(data: bytes) -> Surrogate:
        """Read a surrogate file's bytes (``payload.py``), also those of version 5.

        Raises:
            PayloadError: the bytes are damaged or of another version.
        """
        return decode(data, Surrogate)

    def save(self, path: Path) -> None:
        """Write the surrogate file; an old one stays as it is where that fails."""
        write_whole(path, self.to_bytes())
