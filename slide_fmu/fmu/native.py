"""A surrogate on the kernels of the C runtime, without FMI: records and windows, on all cores.

The compiled library exports the functions of ``runtime/native/native.h`` beside those of FMI.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import checked_batch
from slide_fmu.fmu.native_layers import Layers
from slide_fmu.fmu.native_library import (
    Handles,
    NativeError,
    checked_threads,
    groups,
    kernels,
    library_path,
)
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate

__all__ = ["NativeError", "NativeSurrogate", "kernels", "library_path"]

TOGETHER, TOGETHER_BACK = 32, 8
"""Records that go together in the C runtime (``record_kernel.h``), and those on the way back, in
double precision: threads share whole groups."""


class NativeSurrogate:
    """A NativeSurrogate is a surrogate in the C runtime. Final.

    Args:
        surrogate: what is evaluated.
        kernel: index into ``kernels()`` of that of the network.

    Raises:
        NativeError: there is no compiled library, or it refuses the surrogate.
    """

    def __init__(self, surrogate: Surrogate, kernel: int = 0) -> None:
        self.surrogate = surrogate
        self._handles = Handles(surrogate.name, surrogate.to_bytes(), kernel)

    def predict_windows(self, windows: NDArray[Any], threads: int | None = None) -> FloatArray:
        """Predict the outputs of single windows, as ``Surrogate.predict_windows`` does.

        Overlapping windows of a record, as ``numpy.lib.stride_tricks.sliding_window_view`` gives
        them, are read in place: the record is scaled once. (Features that look at inputs before
        the newest are formed window by window: before a window its first input counts.)

        Args:
            windows: physical inputs, shape (B, n_in, n_inputs).
            threads: that share the windows; one per core if None.

        Returns:
            Outputs, shape (B, n_out, n_outputs), in the outputs' units.

        Raises:
            ValueError: wrong shape, values that are not finite, or no threads.
            NativeError: a feature is not finite.
        """
        surrogate, window = self.surrogate, self.surrogate.window
        array = checked_batch("windows", windows, (window.n_in, len(surrogate.inputs)))
        count = checked_threads(threads)
        if len(array) == 0:
            return np.empty((0, window.n_out, len(surrogate.outputs)))
        record, step = _record_behind(array)
        if not np.all(np.isfinite(record)):
            raise ValueError("windows hold values that are not finite; expected numbers")
        network = surrogate.network
        if isinstance(network, FeedForward):
            scaled = surrogate.input_scaling.apply(record)
            shape = (len(array), step, window.n_in)
            values = Layers(network, self._handles).windows(scaled, shape, count)
            blocks = values.reshape(len(array), window.n_out, len(surrogate.outputs))
            return surrogate.output_scaling.invert(blocks.astype(np.float64))
        if not isinstance(network, StateSpace):
            raise self._unknown("batches", "predict_windows")
        outputs = np.empty((len(array), window.n_out, len(surrogate.outputs)))
        self._cells(record, (window.n_in, step, 0), outputs, count)
        return outputs

    def predict(self, records: NDArray[Any], threads: int | None = None) -> FloatArray:
        """Predict whole records as a co-simulation does, many of them side by side.

        Of feed-forward networks the results are those of ``Surrogate.predict_newest``. A network
        of cells runs one state along each record. It begins with what ``predict_newest`` has at
        the first sample, the first input held for n_in samples, and forgets nothing after that,
        where ``predict_newest`` starts its states anew every n_in samples. So both agree, but for
        rounding, in the first n_in - n_out + 1 samples, and after that they differ by what the
        surrogate's memory is too short for: its truncation error (``docs/runtime.md`` has it for
        released FMUs). With n_in = n_out = N, ``predict_windows``
        of records that rest at first is the same.

        Args:
            records: physical inputs, shape (B, N, n_inputs), or (N, n_inputs) of one; N >= 1.
            threads: that share the records; one per core if None. Results do not depend on it.

        Returns:
            Outputs at samples 1 .. N, shape (B, N, n_outputs) or (N, n_outputs), in their units.

        Raises:
            ValueError: wrong shape, values that are not finite, or no threads.
            NativeError: a feature is not finite.
        """
        surrogate = self.surrogate
        array, count = self._checked_records(records), checked_threads(threads)
        outputs = np.empty((*array.shape[:2], len(surrogate.outputs)))
        if isinstance(surrogate.network, FeedForward):
            layers = Layers(surrogate.network, self._handles)
            for record, output in zip(array, outputs, strict=True):
                values = layers.along(surrogate.input_scaling.apply(record), count)
                newest = values[:, -len(surrogate.outputs) :].astype(np.float64)
                output[:] = surrogate.output_scaling.invert(newest)
        elif isinstance(surrogate.network, StateSpace):
            samples, channels = array.shape[1:]
            shape = (samples, samples, surrogate.window.n_in - 1)
            self._cells(array.reshape(-1, channels), shape, outputs, count)
        else:
            raise self._unknown("records", "predict_newest_batch")
        return outputs if np.ndim(records) == 3 else outputs[0]

    def vjp(
        self, records: NDArray[Any], weights: NDArray[Any], threads: int | None = None
    ) -> FloatArray:
        """Compute the gradient of a weighted sum of the outputs of ``predict`` by all inputs.

        Reverse mode in double precision, features included: those of a serial chain by
        differences of a few points, exact to about 1e-12 of the largest terms, everything else in
        closed form. What is differentiated is what ``predict`` computes, so an input of a first
        sample also counts as held before the record. The memory that is needed beside the
        arguments is that of a block of samples, and a state for each block.

        Args:
            records: physical inputs, shape (B, N, n_inputs), or (N, n_inputs) of one; N >= 1.
            weights: of the outputs, shape (B, N, n_outputs) or (N, n_outputs).
            threads: that share the records; one per core if None. Results do not depend on it.

        Returns:
            Derivative of sum(weights * outputs) by the inputs, of the shape of the records; in
            weight times output unit per input unit.

        Raises:
            ValueError: wrong shapes, values that are not finite, or no threads.
            NativeError: the network is no cell, or a feature is not finite.
        """
        surrogate = self.surrogate
        array, count = self._checked_records(records), checked_threads(threads)
        expected = (*np.shape(records)[:-1], len(surrogate.outputs))
        if np.shape(weights) != expected:
            raise ValueError(f"weights: shape {np.shape(weights)}; expected {expected}")
        of_outputs = np.ascontiguousarray(weights, dtype=np.float64)
        of_outputs = of_outputs.reshape(*array.shape[:2], expected[-1])
        if not np.all(np.isfinite(of_outputs)):
            raise ValueError("weights hold values that are not finite; expected numbers")
        if not isinstance(surrogate.network, StateSpace):
            kind = type(surrogate.network).__name__
            raise NativeError(
                f"no gradients of networks of type {kind} in the runtime; use slide_fmu.gradient, "
                "window by window"
            )
        slopes = np.empty(array.shape)

        def run(handle: int, some: slice) -> int:
            inputs, of_some, place = array[some], of_outputs[some], slopes[some]
            pointers = inputs.ctypes.data, of_some.ctypes.data, *inputs.shape[:2]
            return int(
                self._handles.library.slide_native_slopes(handle, *pointers, place.ctypes.data)
            )

        self._handles.run(run, groups(len(array), TOGETHER_BACK, count))
        return slopes.reshape(np.shape(records))

    def _checked_records(self, records: NDArray[Any]) -> FloatArray:
        """Records of shape (B, N, n_inputs), which lie in one piece of memory."""
        channels, shape = len(self.surrogate.inputs), np.shape(records)
        if len(shape) not in (2, 3) or shape[-1] != channels or shape[-2] < 1:
            raise ValueError(
                f"records: shape {shape}; expected (B, N, {channels}), or (N, {channels}) of a "
                "single one, with at least one sample"
            )
        array = np.ascontiguousarray(records, dtype=np.float64).reshape(-1, *shape[-2:])
        if not np.all(np.isfinite(array)):
            raise ValueError("records hold values that are not finite; expected numbers")
        return array

    def _cells(
        self,
        inputs: FloatArray,
        shape: tuple[int, int, int],
        outputs: FloatArray,
        threads: int,
    ) -> None:
        """Run cells along records, some groups of them in each thread.

        The inputs (samples, n_inputs) hold one record after the other; shape: samples of each,
        samples between the first ones of two, and those that the first input is held before. The
        outputs, (B, n_given, n_outputs), are those of the last n_given samples of each.
        """
        rows = np.ascontiguousarray(inputs)
        length, step, held = shape

        def run(handle: int, some: slice) -> int:
            place = outputs[some]
            begin = rows[some.start * step :].ctypes.data
            sizes = len(place), length, step, held, place.shape[1]
            return int(
                self._handles.library.slide_native_records(
                    handle, begin, *sizes, place.ctypes.data
                )
            )

        self._handles.run(run, groups(len(outputs), TOGETHER, threads))

    def _unknown(self, what: str, instead: str) -> NativeError:
        kind = type(self.surrogate.network).__name__
        return NativeError(
            f"no {what} of networks of type {kind} in the runtime; use Surrogate.{instead}"
        )


def _record_behind(windows: FloatArray) -> tuple[FloatArray, int]:
    """The record (samples, channels) that windows are cut from, and the samples between them.

    Windows that are no parts of a record are laid out one after the other.
    """
    count, n_in, channels = windows.shape
    between, sample, _ = windows.strides
    if n_in == 1 or sample <= 0 or not 0 <= between <= n_in * sample or between % sample:
        return windows.reshape(count * n_in, channels), n_in
    step = between // sample if count > 1 else n_in
    shape = ((count - 1) * step + n_in, channels)
    strides = (sample, windows.strides[2])
    return np.lib.stride_tricks.as_strided(windows, shape, strides, writeable=False), step
