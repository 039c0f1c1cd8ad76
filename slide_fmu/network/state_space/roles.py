"""What each feature that a state-space network sees is for."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Roles:
    """Which signals a state-space network uses, and for what: indices of its features.

    Attributes:
        drive: f, the state input, which moves the states.
        static: w, the feedthrough, which the values follow at once.
        gated: g, which gated (LPV) units multiply beside the states.
        schedule: s, the scheduling variables, which open and close gated units.
        readout: r, factors of the values beside the constant one.
        turn: cosine and sine of the angle of the frame in which gated units act; or none.
    """

    drive: tuple[int, ...]
    static: tuple[int, ...]
    gated: tuple[int, ...] = ()
    schedule: tuple[int, ...] = ()
    readout: tuple[int, ...] = ()
    turn: tuple[int, ...] = ()

    def highest(self) -> int:
        """The highest index used; -1 if there is none."""
        return max((i for field in fields(self) for i in getattr(self, field.name)), default=-1)
