"""Feed-forward networks run on the kernels of the C runtime: windows, or every sample of a
sequence."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import final

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.native_library import Handles, NativeError
from slide_fmu.network.feed_forward.network import FeedForward


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
