"""A reader takes little-endian values from bytes, one after the other, never beyond their end."""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray


@final
class Reader:
    """A Reader takes little-endian values from bytes and never reads beyond their end.

    Every method that takes numbers raises a ValueError where too few bytes are left. The message
    has the number of bytes expected and left.
    """

    def __init__(self, data: bytes, position: int = 0) -> None:
        self.data = data
        self.position = position

    def take(self, count: int) -> bytes:
        """Take ``count`` bytes."""
        if count > len(self.data) - self.position:
            raise ValueError(f"{count} bytes expected, {len(self.data) - self.position} left")
        self.position += count
        return self.data[self.position - count : self.position]

    def u32(self) -> int:
        """Take one unsigned integer."""
        return int.from_bytes(self.take(4), "little")

    def indices(self) -> tuple[int, ...]:
        """Take a count and that number of unsigned integers; ``indices_bytes`` wrote them."""
        count = self.u32()
        return tuple(int(i) for i in np.frombuffer(self.take(4 * count), dtype="<u4"))

    def f64(self, count: int) -> NDArray[np.float64]:
        """Take ``count`` numbers of float64."""
        return np.frombuffer(self.take(8 * count), dtype="<f8").astype(np.float64)

    def f32(self, *shape: int) -> NDArray[np.float32]:
        """Take an array of float32, row by row."""
        flat = np.frombuffer(self.take(4 * int(np.prod(shape, dtype=object))), dtype="<f4")
        return flat.astype(np.float32).reshape(shape)

    def section(self, tag: bytes) -> Reader:
        """Take a section: its tag of four bytes, its length, and its content.

        Raises:
            ValueError: there is another section, or too few bytes.
        """
        read = self.take(4)
        if read != tag:
            raise ValueError(f"section {read!r}; expected {tag!r}")
        return Reader(self.take(self.u32()))

    def done(self) -> None:
        """Raise a ValueError with the number of bytes left, if there are any."""
        if self.position != len(self.data):
            raise ValueError(f"{len(self.data) - self.position} bytes too many in a section")


def indices_bytes(indices: tuple[int, ...]) -> bytes:
    """Write unsigned integers, their number first; ``Reader.indices`` reads them."""
    return np.array([len(indices), *indices], dtype="<u4").tobytes()
