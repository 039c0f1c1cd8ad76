"""A surrogate runs on the kernels of the C runtime without FMI: sequences and windows, on all
cores.

The compiled library exports the functions of ``runtime/native/native.h`` in addition to FMI's.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import checked_batch
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

TOGETHER, TOGETHER_BACK = 16, 8
"""Number of sequences that are worth a thread of their own, and in reverse mode, in double
precision: in the C runtime (``record_kernel.h``) more of them at once are hardly faster."""


@final
class NativeSurrogate:
    """A NativeSurrogate is a surrogate in the C runtime.

    Args:
        surrogate: the surrogate to evaluate.
        kernel: index into ``kernels()``, for the network's kernel.

    Raises:
        NativeError: there is no compiled library, or it refuses the surrogate.
    """

    def __init__(self, surrogate: Surrogate, kernel: int = 0) -> None:
        self.surrogate = surrogate
        self._handles = Handles(surrogate.name, surrogate.to_bytes(), kernel)

    def predict_windows(self, windows: NDArray[Any], threads: int | None = None) -> FloatArray:
        """Predict the outputs of single windows, as ``Surrogate.predict_windows`` does.

        Overlapping windows of a sequence, as from ``numpy.lib.stride_tricks.sliding_window_view``,
        are read in place: the sequence is scaled once. (Features that need inputs before the
        newest one are formed window by window: a window counts as constant before its first
        input.)

        Args:
            windows: physical inputs, shape (B, n_in, n_inputs).
            threads: number of threads that share the windows; one per core if None.

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
        sequence, step = _sequence_behind(array)
        if not np.all(np.isfinite(sequence)):
            raise ValueError("windows hold values that are not finite; expected numbers")
        network = surrogate.network
        if isinstance(network, FeedForward):
            scaled = surrogate.input_scaling.apply(sequence)
            shape = (len(array), step, window.n_in)
            values = Layers(network, self._handles).windows(scaled, shape, count)
            blocks = values.reshape(len(array), window.n_out, len(surrogate.outputs))
            return surrogate.output_scaling.invert(blocks.astype(np.float64))
        if not isinstance(network, StateSpace):
            raise self._unknown("batches", "predict_windows")
        outputs = np.empty((len(array), window.n_out, len(surrogate.outputs)))
        self._cells(sequence, (window.n_in, step, 0), outputs, count)
        return outputs

    def predict(self, sequences: NDArray[Any], threads: int | None = None) -> FloatArray:
        """Predict whole sequences as a co-simulation does, many of them in parallel.

        With feed-forward networks the results are equal to ``Surrogate.predict_newest``. A
        state-space network runs one state along each sequence. It starts like ``predict_newest``,
        with the first input held for n_in samples. After that it forgets nothing, while
        ``predict_newest`` restarts its states every n_in samples. So both agree, up to rounding,
        in the first n_in - n_out + 1 samples. After that they differ by the effect of the
        surrogate's finite memory, its truncation error (``slide_fmu/fmu/runtime/README.md``
        has it for released FMUs). ``predict_windows`` with n_in = n_out = N gives the same for
        sequences that start at rest.

        Args:
            sequences: physical inputs, shape (B, N, n_inputs), or (N, n_inputs) of one; N >= 1.
            threads: number of threads that share the sequences; one per core if None. Results do
                not depend on it.

        Returns:
            Outputs at samples 1 .. N, shape (B, N, n_outputs) or (N, n_outputs), in their units.

        Raises:
            ValueError: wrong shape, values that are not finite, or no threads.
            NativeError: a feature is not finite.
        """
        surrogate = self.surrogate
        array, count = self._checked_sequences(sequences), checked_threads(threads)
        outputs = np.empty((*array.shape[:2], len(surrogate.outputs)))
        if isinstance(surrogate.network, FeedForward):
            layers = Layers(surrogate.network, self._handles)
            for sequence, output in zip(array, outputs, strict=True):
                values = layers.along(surrogate.input_scaling.apply(sequence), count)
                newest = values[:, -len(surrogate.outputs) :].astype(np.float64)
                output[:] = surrogate.output_scaling.invert(newest)
        elif isinstance(surrogate.network, StateSpace):
            samples, channels = array.shape[1:]
            shape = (samples, samples, surrogate.window.n_in - 1)
            self._cells(array.reshape(-1, channels), shape, outputs, count)
        else:
            raise self._unknown("sequences", "predict_newest_batch")
        return outputs if np.ndim(sequences) == 3 else outputs[0]

    def vjp(
        self, sequences: NDArray[Any], weights: NDArray[Any], threads: int | None = None
    ) -> FloatArray:
        """Compute the gradient of a weighted sum of the outputs of ``predict`` by all inputs.

        It is reverse mode in double precision, including features. Features of a serial chain use
        differences of a few points, exact to about 1e-12 of the largest terms; everything else has
        closed form. The derivative is that of ``predict``, so a first input also counts as
        constant before the sequence. In addition to the arguments, memory is needed for one block
        of samples, and for one state per block.

        Args:
            sequences: physical inputs, shape (B, N, n_inputs), or (N, n_inputs) of one; N >= 1.
            weights: of the outputs, shape (B, N, n_outputs) or (N, n_outputs).
            threads: number of threads that share the sequences; one per core if None. Results do
                not depend on it.

        Returns:
            Derivative of sum(weights * outputs) by the inputs, in the shape of the sequences; in
            weight times output unit per input unit.

        Raises:
            ValueError: wrong shapes, values that are not finite, or no threads.
            NativeError: the network is not a state-space network, or a feature is not finite.
        """
        surrogate = self.surrogate
        array, count = self._checked_sequences(sequences), checked_threads(threads)
        expected = (*np.shape(sequences)[:-1], len(surrogate.outputs))
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
        return slopes.reshape(np.shape(sequences))

    def _checked_sequences(self, sequences: NDArray[Any]) -> FloatArray:
        """Return sequences of shape (B, N, n_inputs) in contiguous memory."""
        channels, shape = len(self.surrogate.inputs), np.shape(sequences)
        if len(shape) not in (2, 3) or shape[-1] != channels or shape[-2] < 1:
            raise ValueError(
                f"sequences: shape {shape}; expected (B, N, {channels}), or (N, {channels}) of a "
                "single one, with at least one sample"
            )
        array = np.ascontiguousarray(sequences, dtype=np.float64).reshape(-1, *shape[-2:])
        if not np.all(np.isfinite(array)):
            raise ValueError("sequences hold values that are not finite; expected numbers")
        return array

    def _cells(
        self,
        inputs: FloatArray,
        shape: tuple[int, int, int],
        outputs: FloatArray,
        threads: int,
    ) -> None:
        """Run cells along sequences; each thread takes some groups of them.

        The inputs (samples, n_inputs) hold one sequence after the other. ``shape`` has the samples
        of each, the distance between the starts of two, and the number of samples that the first
        input is held before. The outputs, (B, n_given, n_outputs), belong to the last n_given
        samples of each.
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


@final
class Layers:
    """Layers run a feed-forward network in the C runtime.

    Args:
        network: the network.
        handles: the surrogate that it belongs to; threads share the first handle.
    """

    def __init__(self, network: FeedForward, handles: Handles) -> None:
        self._network, self._handles = network, handles

    def windows(
        self, scaled: FloatArray, shape: tuple[int, int, int], threads: int
    ) -> NDArray[np.float32]:
        """Evaluate windows of scaled rows (samples, n_inputs).

        ``shape`` has the number of windows, the distance between two of them, and the samples of
        each. Values (K, n_values) are returned, one for each window, or one for each of its last
        positions.
        """
        count, step, n_in = shape
        if self._network.features.features.n_before > 0:
            starts = step * np.arange(count)[:, None] + np.arange(n_in)
            sequences, step = scaled[starts], n_in
        else:
            sequences = scaled[None]
        last = n_in - self._network.n_samples + 1
        firsts = step * np.arange(count)[:, None] + np.arange(last)
        return self._evaluated(sequences, firsts.reshape(-1), threads)

    def along(self, scaled: FloatArray, threads: int) -> NDArray[np.float32]:
        """Evaluate at every sample of a scaled sequence, (N, n_inputs), to (N, n_values).

        The first sample counts as constant before the sequence.
        """
        lead = ((self._network.n_samples - 1, 0), (0, 0))
        padded = np.pad(scaled, lead, mode="edge")
        return self._evaluated(padded[None], np.arange(len(scaled)), threads)

    def _evaluated(
        self, sequences: FloatArray, firsts: NDArray[np.int64], threads: int
    ) -> NDArray[np.float32]:
        """Return values (K, n_values) of windows that start at K rows of the sequences."""
        network, seen = self._network, self._network.features
        with np.errstate(all="ignore"):
            features = seen.along(sequences).reshape(-1, seen.n_signals)
        rows = np.ascontiguousarray(features, dtype=np.float32)
        if not np.all(np.isfinite(rows)):
            raise NativeError("a feature of the inputs is not finite")
        if network.ages:
            picked = network.n_samples - 1 - np.array(network.ages)
            rows = np.ascontiguousarray(rows[firsts[:, None] + picked].reshape(-1, 1))
            firsts = len(picked) * seen.n_signals * np.arange(firsts.size)
        begins = rows.ctypes.data + firsts.astype(np.uintp) * np.uintp(rows.strides[0])
        values = np.empty((firsts.size, network.n_values), dtype=np.float32)
        self._share(begins, values, threads)
        return values

    def _share(self, begins: NDArray[np.uintp], values: NDArray[np.float32], threads: int) -> None:
        """Let each thread evaluate some of the windows, which begin at these places of memory."""
        bounds = np.linspace(0, len(begins), threads + 1).astype(int)
        function, handle = self._handles.library.slide_native_layers, self._handles.first

        def run(index: int) -> int:
            first, last = bounds[index], bounds[index + 1]
            pointers = np.ascontiguousarray(begins[first:last])
            place = values[first:last].ctypes.data
            return int(function(handle, pointers.ctypes.data, len(pointers), place))

        if threads == 1:
            failed = [run(0)]
        else:
            with ThreadPoolExecutor(threads) as pool:
                failed = list(pool.map(run, range(threads)))
        if any(failed):
            raise NativeError("there is no memory left for the layers")


def _sequence_behind(windows: FloatArray) -> tuple[FloatArray, int]:
    """Return the sequence (samples, channels) that windows are cut from, and their distance.

    Windows that are not parts of one sequence are copied one after the other.
    """
    count, n_in, channels = windows.shape
    between, sample, _ = windows.strides
    if n_in == 1 or sample <= 0 or not 0 <= between <= n_in * sample or between % sample:
        return windows.reshape(count * n_in, channels), n_in
    step = between // sample if count > 1 else n_in
    shape = ((count - 1) * step + n_in, channels)
    strides = (sample, windows.strides[2])
    return np.lib.stride_tricks.as_strided(windows, shape, strides, writeable=False), step
