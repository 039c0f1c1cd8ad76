"""The surrogate is the only object that passes from training to export. It needs numpy only."""

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
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.surrogate.error_bound import ErrorBound
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.input_forecast import InputForecast
from slide_fmu.surrogate.payload import decode, encode
from slide_fmu.surrogate.trust import Trust


@dataclass(frozen=True, eq=False)
class Surrogate:
    """A Surrogate replaces a system; it has window, scalings, network and error estimator.

    Attributes:
        name: C identifier; name of the FMU.
        window: the index law.
        inputs: input signals, in channel order, with ranges, holds and angles as in training;
            their start values lie in offset -+ scale of the scaling.
        outputs: output signals, in channel order.
        input_scaling: maps physical inputs to network inputs.
        output_scaling: maps physical outputs to network outputs.
        network: maps the scaled input window to scaled outputs. Its weights may follow physical
            parameters; these have their start values unless others are given.
        estimator: error estimator, or None.
        forecast: forecast of inputs with a first-order hold, and whether the FMU uses it; None
            with a zero-order hold, or if inputs are set to the values at the end of the step.
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

    def __repr__(self) -> str:
        """Describe the surrogate in a few lines: signals, window, network and bound."""
        return str(SurrogateDescription.of(self))

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
        """Return the physical parameters that users may set, in order; mostly empty."""
        return self.network.parameters if isinstance(self.network, Parametric) else ()

    def at(self, parameters: Mapping[str, float]) -> Surrogate:
        """Return the surrogate for fixed values of its parameters; the result has no parameters.

        Args:
            parameters: values by name, in the parameters' units; missing ones have start values.

        Raises:
            ValueError: a name is unknown, or a value lies outside its range.
        """
        values = checked_values(self.parameters, parameters)
        if not isinstance(self.network, Parametric) or len(values) == 0:
            return self
        return dataclasses.replace(self, network=self.network.at(values))

    def starting_at(self, parameters: Mapping[str, float]) -> Surrogate:
        """Return the surrogate with other start values of its parameters, by name.

        Parameters that are not given keep their start values.

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
        """Return whether the FMU's inputs count as reached by the end of the step at its start."""
        return self.forecast is not None and self.forecast.at_step_end

    @property
    def planned(self) -> bool:
        """Return whether inputs are planned motions, known ahead, with the model's curves."""
        return self.forecast is not None and self.forecast.planned

    def reaching_inputs_by_step_end(self) -> Surrogate:
        """Return the surrogate whose FMU starts with ``inputs_at_step_end`` = 1.

        A surrogate whose inputs have a zero-order hold has no such parameter and is returned as it
        is.
        """
        if self.hold == "zero_order":
            return self
        count = len(self.inputs)
        without = InputForecast(weights=np.zeros((count, 0, 1)), largest_change=np.zeros(count))
        forecast = dataclasses.replace(self.forecast or without, at_step_end=True)
        return dataclasses.replace(self, forecast=forecast)

    @property
    def starts(self) -> FloatArray:
        """Return the inputs before a user sets them, in their units, shape (n_inputs,)."""
        return np.array([signal.start_value for signal in self.inputs], dtype=np.float64)

    @property
    def memory_length(self) -> int:
        """Return the number of input samples that any result may depend on.

        It is the longest of the input window and the memories of error estimator and error bound,
        plus the ``BEFORE`` samples that features need before them. The C runtime calls it
        ``memory_length`` too.
        """
        others = [part.memory_length for part in (self.estimator, self.bound) if part is not None]
        return max(self.window.n_in, *others, 0) + BEFORE

    @property
    def estimates_errors(self) -> bool:
        """Return whether ``estimate_error`` works, by an estimator or by the bound."""
        return self.estimator is not None or (
            self.bound is not None and self.bound.span is not None
        )

    @property
    def estimated_samples(self) -> int:
        """Return the number of samples of an error estimate; the output window's without one."""
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
        self,
        inputs: NDArray[Any],
        parameters: Mapping[str, float] | None = None,
        known_outputs: NDArray[Any] | None = None,
    ) -> FloatArray:
        """Predict a long sequence in blocks of n_out samples (paper: stride n_out).

        The first input counts as constant before the sequence. Where the first outputs are known,
        as by a measurement that begins in mid-motion, they say in which state it begins: until the
        window is filled, the network then runs from there.

        Args:
            inputs: shape (N, n_inputs), N >= 1, in the inputs' units.
            parameters: values by name, as for ``at``; the start values if None.
            known_outputs: outputs at samples 1 .. K, some tens of them, shape (K, n_outputs), in
                the outputs' units; NaN where they are not known. None if nothing is known.

        Returns:
            Outputs at samples 1 .. N, shape (N, n_outputs).

        Raises:
            ValueError: wrong number of channels, no samples, values that are not finite, bad
                parameters as in ``at``, or known outputs that do not fit (``run_from_outputs``).
        """
        own = self.at(parameters or {})
        outputs = self.in_blocks(inputs, own.predict_windows)
        if known_outputs is not None:
            checked = checked_inputs(inputs, self.inputs)
            begun = max(self.window.n_in, len(known_outputs))
            outputs[:begun], _ = own.run_from_outputs(checked[:begun], known_outputs)
        return outputs

    def run_from_outputs(
        self, inputs: NDArray[Any], known_outputs: NDArray[Any]
    ) -> tuple[FloatArray, FloatArray]:
        """Run the network along inputs, never restarted, from the state that outputs show.

        A sequence that begins in mid-motion has a past that nobody knows, and constant inputs in
        its place are wrong until the window is filled. The state that explains the first outputs
        best is right from the start.

        Args:
            inputs: shape (N, n_inputs), in the inputs' units.
            known_outputs: as of ``predict``, with K at most N.

        Returns:
            Outputs at samples 1 .. N, (N, n_outputs), and the state before the first, (n_states,).

        Raises:
            ValueError: the network has no state, no output is known, or the shape does not fit.
        """
        from slide_fmu.network.state_space.initial_state import initial_state  # loads scipy

        checked = checked_inputs(inputs, self.inputs)
        network, known = self.network, np.asarray(known_outputs, dtype=np.float64)
        if not isinstance(network, StateSpace):
            raise ValueError(
                f"known_outputs for surrogate {self.name!r}, whose network has no state; expected "
                "none: leave them out, since its outputs depend on one window of inputs"
            )
        count, n_outputs = len(checked), len(self.outputs)
        fits = known.ndim == 2 and known.shape[1] == n_outputs and 1 <= len(known) <= count
        if not fits or not np.isfinite(known).any():
            raise ValueError(
                f"known_outputs of shape {known.shape}, {int(np.isfinite(known).sum())} of them "
                f"finite; expected (K, {n_outputs}) with K from 1 to {count}, the number of "
                "inputs, and at least one that is known: give the measured outputs of the first "
                "samples"
            )
        features = network.features.exactly_along(self.input_scaling.apply(checked)[None])
        scaled = self.output_scaling.apply(known)
        state = initial_state(network, features[0, : len(known)], scaled)
        with np.errstate(over="ignore", invalid="ignore"):  # a run that diverges is not finite
            values, _ = network.run(features.astype(np.float32), state[None].astype(np.float32))
        return self.output_scaling.invert(values[0].astype(np.float64)), state

    def in_blocks(
        self, inputs: NDArray[Any], evaluate: Callable[[FloatArray], FloatArray]
    ) -> FloatArray:
        """Evaluate a long sequence in blocks of n_out samples, as ``predict`` does.

        Args:
            inputs: as for ``predict``.
            evaluate: maps windows of it, shape (B, n_in, n_inputs), to values of any kind at the
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
        """Predict a long sequence as a co-simulation does: the newest output of every step.

        Args:
            inputs: sequence of the inputs in their units, shape (N, n_inputs).
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
        """Predict many sequences of the same length by ``predict_newest``.

        Inputs of the shape (B, N, n_inputs) give outputs (B, N, n_outputs).
        """
        checked, network = checked_inputs(inputs, self.inputs, "sequences, "), self.network
        if parameters:
            network = self.at(parameters).network
        values = network.stream(self.input_scaling.apply(checked))
        newest = values[:, :, -len(self.outputs) :].astype(np.float64)
        return self.output_scaling.invert(newest)

    def estimate_error(self, inputs: NDArray[Any]) -> FloatArray:
        """Estimate the RMSE over the ``estimated_samples`` that end at each sample.

        For a surrogate with parameters it is the usual error over all their values.

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
        """Evaluate the error bound: bounds, domain and trust of every sample.

        Args:
            inputs: shape (N, n_inputs), N >= 1, in the inputs' units.

        Raises:
            ValueError: there is no error bound, or bad inputs as in ``predict``.
        """
        bound = self._required_bound()
        return self._trusts(bound, checked_inputs(inputs, self.inputs)[None])[0]

    def trust_batch(self, sequences: NDArray[Any]) -> list[Trust]:
        """Evaluate the error bound along B sequences of the same length, (B, N, n_inputs).

        Raises:
            ValueError: as for ``trust``.
        """
        bound = self._required_bound()
        return self._trusts(bound, checked_inputs(sequences, self.inputs, "sequences, "))

    def _required_bound(self) -> ErrorBound:
        if self.bound is None:
            raise ValueError(
                f"surrogate {self.name!r} has no error bound; train one: the recipe's table "
                "[bound]"
            )
        return self.bound

    def _trusts(self, bound: ErrorBound, sequences: FloatArray) -> list[Trust]:
        scaled = self.input_scaling.apply(sequences)
        predicted = self.network.stream(scaled).astype(np.float64)
        return [
            Trust(
                bound,
                self.output_scaling.scale,
                local,
                (local.novelty <= 1) & self._in_range(inputs),
                self._known_outputs(outputs),
            )
            for local, inputs, outputs in zip(
                bound.along(scaled, predicted), scaled, predicted, strict=True
            )
        ]

    def _in_range(self, scaled: FloatArray) -> NDArray[np.bool_]:
        return inside_throughout(in_ranges(self.inputs, scaled), self.network.memory_length)

    def _known_outputs(self, predicted: FloatArray) -> NDArray[np.bool_]:
        if self.output_ranges is None:
            return np.ones(len(predicted), dtype=np.bool_)
        return self.outputs_in_range(self.output_scaling.invert(predicted))

    @property
    def error_tolerances(self) -> FloatArray:
        """The largest 95 % bounds that are trusted, (n_outputs,), in the outputs' units.

        They are the start values of the FMU's parameters ``<output>_error_tolerance``.

        Raises:
            ValueError: there is no error bound.
        """
        return np.asarray(self._required_bound().tolerances * self.output_scaling.scale)

    def inputs_in_range(self, inputs: NDArray[Any]) -> NDArray[np.bool_]:
        """Return at which samples the inputs of the outputs lie in range: (N, n_inputs) to (N,).

        The last ``network.memory_length`` inputs must lie in their ranges; the first counts as
        constant before. For an angle, the length of cosine and sine must be about 1.

        Raises:
            ValueError: as for ``predict``.
        """
        return self._in_range(self.input_scaling.apply(checked_inputs(inputs, self.inputs)))

    def outputs_in_range(self, outputs: FloatArray) -> NDArray[np.bool_]:
        """Return where all outputs, (N, n_outputs), lie in the ranges of the training, (N,).

        Raises:
            ValueError: the ranges of the training are not known.
        """
        if self.output_ranges is None:
            raise ValueError("the ranges of the outputs in the training are not known")
        low, high = self.output_ranges.T
        return np.asarray(np.all((outputs >= low) & (outputs <= high), axis=1))

    def truncation_errors(self, inputs: NDArray[Any]) -> FloatArray | None:
        """Return the last measured truncation error of each output, at each sample.

        Inputs (N, n_inputs) give (N, n_outputs), in the outputs' units; None if the network does
        not measure it.

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
        return encode(
            {
                "name": self.name,
                "window": self.window,
                "inputs": self.inputs,
                "outputs": self.outputs,
                "input_scaling": self.input_scaling,
                "output_scaling": self.output_scaling,
                "network": self.network,
                "estimator": self.estimator,
                "forecast": self.forecast,
                "bound": self.bound,
                "output_ranges": self.output_ranges,
            }
        )

    @staticmethod
    def from_bytes(data: bytes) -> Surrogate:
        """Read a surrogate file's bytes (``payload.py``).

        Raises:
            PayloadError: the bytes are damaged or of another version.
        """
        return decode(data, Surrogate)

    def save(self, path: Path) -> None:
        """Write the surrogate file; if that fails, an old file stays."""
        write_whole(path, self.to_bytes())
