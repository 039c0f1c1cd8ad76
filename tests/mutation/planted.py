"""Faults that once no test saw, and the test of each that sees it today."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from tests.mutation.trials import copies, outcome

LONGEST = 600.0
"""Time in s that the test of a fault may take."""


@dataclass(frozen=True)
class Planted:
    """A fault in a source, and the test that sees it.

    Attributes:
        source: path below the root.
        sound: a piece of the source that stands there once.
        faulty: what is put in its place.
        test: file and function, as pytest names them.
    """

    source: str
    sound: str
    faulty: str
    test: str

    def plant(self, place: Path) -> str:
        """Put the fault into a copy of the repository, and return the source as it was.

        Raises:
            ValueError: the sound piece does not stand there exactly once.
        """
        text = (place / self.source).read_text(encoding="utf-8")
        if (count := text.count(self.sound)) != 1:
            raise ValueError(
                f"{self.source} has {count} times {self.sound!r}; expected it once: "
                "write the planted fault anew for the source as it is today"
            )
        changed = text.replace(self.sound, self.faulty)
        (place / self.source).write_text(changed, encoding="utf-8")
        return text


PLANTED = {
    "inputs count as out of range for one sample too long": Planted(
        "slide_fmu/fmu/runtime/window/stream.c",
        "behind >= memory)",
        "behind > memory)",
        "tests/fmu/test_ranges.py"
        "::test_one_input_out_of_range_counts_until_the_memory_has_lost_it",
    ),
    "samples are scored before the network has seen the inputs that it needs": Planted(
        "slide_fmu/validation/comparison.py",
        "first = max(drawn.burn_in + 1, surrogate.network.memory_length)",
        "first = drawn.burn_in + 1",
        "tests/validation/test_comparison.py"
        "::test_scores_begin_after_the_burn_in_where_all_inputs_were_set",
    ),
    "the true error stands beside the estimate of the next sample": Planted(
        "slide_fmu/validation/comparison.py",
        "true_error[span - 1 :] = moving_rms(given.error, span)",
        "true_error[span - 1 :] = np.roll(moving_rms(given.error, span), 1, axis=0)",
        "tests/validation/test_comparison.py"
        "::test_true_error_is_that_of_the_span_which_ends_at_the_sample",
    ),
    "stretches of motions are as long as the window, however long the decay takes": Planted(
        "slide_fmu/memory/motions.py",
        "samples = max(window.n_in, decay_time / window.step)",
        "samples = window.n_in",
        "tests/memory/test_sizing.py"
        "::test_stretch_is_as_long_as_the_window_or_the_decay_whichever_is_longer",
    ),
}


def verdict(place: Path, fault: Planted) -> str:
    """Whether the test of a fault sees it: it passes without the fault, and fails with it.

    Returns:
        "seen", "not seen", or what else happened, as text.
    """
    if (end := outcome(place, (), (fault.test,), LONGEST)) != "passed":
        return f"{end} without the fault"
    sound = fault.plant(place)
    end = outcome(place, (fault.source,), (fault.test,), LONGEST)
    (place / fault.source).write_text(sound, encoding="utf-8")
    return {"failed": "seen", "passed": "not seen"}.get(end, f"{end} with the fault")


def plant_all() -> int:
    """Plant every fault in a copy of its own, and print what became of it.

    Returns:
        how many were not seen.
    """
    missed = 0
    with copies(len(PLANTED)) as places:
        for place, (name, fault) in zip(places, PLANTED.items(), strict=True):
            result = verdict(place, fault)
            missed += result != "seen"
            print(f"{result}: {name}\n  by {fault.test}", file=sys.stderr, flush=True)
    return missed
