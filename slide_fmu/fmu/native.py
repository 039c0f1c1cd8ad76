"""A surrogate on the kernels of the C runtime, without FMI: records and windows, on all cores.

The compiled library exports the functions of ``runtime/native/native.h`` beside those of FMI.
"""

from __future__ import annotations

import ctypes
import os
import threading
import weakref
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import checked_batch
from slide_fmu.fmu.libraries.build import BINARIES, TARGETS
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate

TOGETHER, TOGETHER_BACK = 32, 8
"""Records that go together in the C runtime (``record_kernel.h``), and those on the way back, in
double precision: threads share whole groups."""
MESSAGE = 400
"""Bytes for the message of a refusal."""


class NativeError(RuntimeError):
    """The library is missing, refused the surrogate, or a result is not finite."""


def kernels() -> list[str]:
    """Name the kernels that this processor supports, the fastest first.

    Raises:
        NativeError: there is no compiled library.
    """
    library = _library()
    names: list[str] = []
    while (name := library.slide_native_kernel(len(names))) is not None:
        names.append(name.decode().removeprefix("slide_kernel_"))
    return names


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
        self._payload, self._kernel = surrogate.to_bytes(), kernel
        self._library = _library()
        self._handles = [self._open()]
        self._lock = threading.Lock()

    def _open(self) -> int:
        message = ctypes.create_string_buffer(MESSAGE)
        handle = self._library.slide_native_open(
            self._payload, len(self._payload), self._kernel, message, MESSAGE
        )
        if not handle:
            raise NativeError(f"surrogate {self.surrogate.name!r}: {message.value.decode()}")
        weakref.finalize(self, self._library.slide_native_close, handle)
        return int(handle)

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
        count = _checked_threads(threads)
        if len(array) == 0:
            return np.empty((0, window.n_out, len(surrogate.outputs)))
        record, step = _record_behind(array)
        if not np.all(np.isfinite(record)):
            raise ValueError("windows hold values that are not finite; expected numbers")
        network = surrogate.network
        if isinstance(network, FeedForward):
            scaled = surrogate.input_scaling.apply(record)
            values = self._layers(network, scaled, len(array), step, count)
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
        rounding, up to sample n_in - n_out, and after that they differ by what the surrogate's
        memory is too short for: its truncation error. With n_in = n_out = N, ``predict_windows``
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
        array, count = self._checked_records(records), _checked_threads(threads)
        outputs = np.empty((*array.shape[:2], len(surrogate.outputs)))
        if isinstance(surrogate.network, FeedForward):
            for record, output in zip(array, outputs, strict=True):
                output[:] = self._newest(surrogate.network, record, count)
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
        array, count = self._checked_records(records), _checked_threads(threads)
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
            return int(self._library.slide_native_slopes(handle, *pointers, place.ctypes.data))

        self._in_threads(run, _groups(len(array), TOGETHER_BACK, count))
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

    def _newest(self, network: FeedForward, record: FloatArray, threads: int) -> FloatArray:
        """Outputs (N, n_outputs) of layers along one record, held before it."""
        surrogate = self.surrogate
        scaled = surrogate.input_scaling.apply(record)
        padded = np.pad(scaled, ((network.n_samples - 1, 0), (0, 0)), mode="edge")
        values = self._evaluated(network, padded[None], np.arange(len(record)), threads)
        newest = values[:, -len(surrogate.outputs) :].astype(np.float64)
        return surrogate.output_scaling.invert(newest)

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
                self._library.slide_native_records(handle, begin, *sizes, place.ctypes.data)
            )

        self._in_threads(run, _groups(len(outputs), TOGETHER, threads))

    def _in_threads(self, run: Callable[[int, slice], int], parts: list[slice]) -> None:
        """Each handle does one part; all have states and scratch of their own."""
        if not parts:
            return
        with self._lock:
            while len(self._handles) < len(parts):
                self._handles.append(self._open())
            handles = self._handles[: len(parts)]
            if len(parts) == 1:
                failed = [run(handles[0], parts[0])]
            else:
                with ThreadPoolExecutor(len(parts)) as pool:
                    failed = list(pool.map(run, handles, parts))
        if any(failed):
            raise NativeError("a feature of the inputs is not finite, or there is no memory left")

    def _unknown(self, what: str, instead: str) -> NativeError:
        kind = type(self.surrogate.network).__name__
        return NativeError(
            f"no {what} of networks of type {kind} in the runtime; use Surrogate.{instead}"
        )

    def _layers(
        self, network: FeedForward, scaled: FloatArray, windows: int, step: int, threads: int
    ) -> NDArray[np.float32]:
        """Values of every evaluation: one a window, or one at each of its last positions."""
        n_in, seen = self.surrogate.window.n_in, network.features
        if seen.features.n_before > 0:
            starts = step * np.arange(windows)[:, None] + np.arange(n_in)
            records, step = scaled[starts], n_in
        else:
            records = scaled[None]
        firsts = step * np.arange(windows)[:, None] + np.arange(n_in - network.n_samples + 1)
        return self._evaluated(network, records, firsts.reshape(-1), threads)

    def _evaluated(
        self,
        network: FeedForward,
        records: FloatArray,
        firsts: NDArray[np.int64],
        threads: int,
    ) -> NDArray[np.float32]:
        """Values (K, n_values) of the network's windows that begin at K rows of the records."""
        seen = network.features
        with np.errstate(all="ignore"):
            features = seen.along(records).reshape(-1, seen.n_signals)
        rows = np.ascontiguousarray(features, dtype=np.float32)
        if not np.all(np.isfinite(rows)):
            raise NativeError("a feature of the windows is not finite")
        if network.ages:
            picked = network.n_samples - 1 - np.array(network.ages)
            rows = np.ascontiguousarray(rows[firsts[:, None] + picked].reshape(-1, 1))
            firsts = len(picked) * seen.n_signals * np.arange(firsts.size)
        values = np.empty((firsts.size, network.n_values), dtype=np.float32)
        function, handles = self._library.slide_native_layers, self._handles * threads
        _share(function, handles[:threads], rows, firsts, values)
        return values


def _share(
    function: Any,
    handles: list[int],
    rows: NDArray[Any],
    firsts: NDArray[np.int64],
    values: NDArray[np.float32],
) -> None:
    """Each handle evaluates some of the windows, which begin at rows ``firsts``, in a thread."""
    begins = rows.ctypes.data + firsts.astype(np.uintp) * np.uintp(rows.strides[0])
    bounds = np.linspace(0, len(firsts), len(handles) + 1).astype(int)

    def run(index: int) -> int:
        first, last = bounds[index], bounds[index + 1]
        pointers = np.ascontiguousarray(begins[first:last])
        place = values[first:last].ctypes.data
        return int(function(handles[index], pointers.ctypes.data, len(pointers), place))

    if len(handles) == 1:
        failed = [run(0)]
    else:
        with ThreadPoolExecutor(len(handles)) as pool:
            failed = list(pool.map(run, range(len(handles))))
    if any(failed):
        raise NativeError("a feature of the windows is not finite, or there is no memory left")


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


def _groups(count: int, together: int, threads: int) -> list[slice]:
    """Slices of so many records, at most one for each thread: whole groups, but for the end."""
    groups = -(-count // together)
    bounds = np.linspace(0, groups, min(threads, groups) + 1).astype(int) * together
    return [slice(first, last) for first, last in pairwise(bounds.tolist())]


def _checked_threads(threads: int | None) -> int:
    count = _available_cores() if threads is None else threads
    if count < 1:
        raise ValueError(f"threads {threads}; expected at least one")
    return count


def _available_cores() -> int:
    return (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )


def _library() -> ctypes.CDLL:
    path = library_path()
    if not path.is_file():
        raise NativeError(
            f"the compiled runtime {path} is missing; run: python -m slide_fmu.fmu.libraries.build"
        )
    library = ctypes.CDLL(str(path))
    handle, text, size = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_size_t
    signatures: dict[str, list[Any]] = {
        "open": [handle, text, size, size, text, size],
        "close": [None, handle],
        "kernel": [text, size],
        "layers": [ctypes.c_int, handle, handle, size, handle],
        "records": [ctypes.c_int, handle, handle, size, size, size, size, size, handle],
        "slopes": [ctypes.c_int, handle, handle, handle, size, size, handle],
    }
    for name, (result, *arguments) in signatures.items():
        function = getattr(library, f"slide_native_{name}")
        function.restype, function.argtypes = result, arguments
    return library


def library_path() -> Path:
    """Find the compiled library of this platform.

    Raises:
        NativeError: there is none for it.
    """
    names = [name for name in TARGETS if name.startswith(f"{fmpy.platform_tuple}/")]
    if not names:
        known = [*map(os.path.dirname, TARGETS)]
        raise NativeError(f"no library for {fmpy.platform_tuple}; expected one of {known}")
    return BINARIES / names[0]
