"""What an instance gives from its present state on."""

from __future__ import annotations

from typing import Protocol

from tests.fmu.samples import STEP


class Instance(Protocol):
    """An instance of either standard."""

    def set(self, *values: float) -> int: ...

    def try_get(self, first: int, count: int = 1) -> tuple[int, list[float]]: ...

    def do_step(self, time: float, step: float = STEP) -> int: ...

    def save(self) -> bytes: ...

    def restore(self, data: bytes) -> int: ...


def future(instance: Instance, time: float, inputs: tuple[float, ...], count: int) -> list[object]:
    """All that is seen of a state, to the bit; the instance goes back to it.

    Bytes of a serialised state may differ where this does not: in places that no result depends
    on any more.

    Args:
        instance: after the initialization.
        time: its time.
        inputs: for some steps, of which one takes in the whole past anew.
        count: how many variables are read, now and after each step.
    """
    saved, seen = instance.save(), list[object]()
    for length in (0.5, 0.1, 1, 3, 1, 1):  # the first may go on from what lies aside
        seen.append(instance.try_get(0, count))
        instance.set(*inputs)
        seen.append(instance.do_step(time, length * STEP))
        time += length * STEP
    seen.append(instance.try_get(0, count))
    instance.restore(saved)
    return seen
