"""Numbers that say how much of its data a state-space fit takes, and so how long it lasts."""

from __future__ import annotations

SEGMENT = 256
"""Approximate number of scored samples in a segment, if the window does not truncate more."""

PER_PARAMETER = 500
"""Number of residuals for each parameter from which on further segments of the same trajectories
teach little. A mass on a hardening spring, 256 trajectories, 192 parameters: 500 of them end at an
error of 0.105 % on unseen motions, all 3600 at 0.103 %, in 2.3 times the time."""

MOST_OF_STARTS = 60_000
"""Largest number of residuals that starts are fitted to: they only need to find the right valley.
On the same mass, 60 000 in the place of 137 000 take two thirds of the time of the whole fit."""

LONG_BURN_IN, FORGOTTEN_BY_STARTS = 512, 0.6
"""Starts have a shorter burn-in than the window truncates, if that is more than the first number
of samples: this part of it, after which less than a hundredth is left of where a cell began."""

SPAN, LATER_SPANS = 50, (150, 400)
"""Length, in samples, of the spans from known states in which all states count, and of those in
which outputs do."""
SAMPLES_PER_PARAMETER, MOST_OF_SPANS = 150, 60_000
"""Number of samples in such spans for each parameter, and their largest number: all states of a
sample count, and those of large motions are chosen more often."""
OF_STATES, OF_OUTPUTS = 30, 30
"""Largest number of iterations of a fit to states, and of the first one to outputs."""

MOST_OF_VALIDATION = 200_000
"""Largest number of residuals that select the parameters."""

THINNEST = 8
"""Largest step between samples in the matrix J'J of an iteration; it divides ``BLOCK`` of
``normal_equations``."""

LINEAR_ITERATIONS = 15
"""Largest number of iterations of a linear fit."""

MOST_OF_LINEAR = 200_000
"""Largest number of residuals for linear fits on all data; above it, the starts' data are used."""

MORE_SHOWN = 2
"""Number of states that the data may hide at first; they may also show too many."""

MANY_STATES = 16
"""Where more states are shown, their number is found by halving the range of orders."""


def halving_orders(most: int) -> list[int]:
    """Return the orders up to ``most`` that halving tries where the largest is needed."""
    orders, too_few = [most], 0
    while most - too_few > 1:
        too_few = (too_few + most) // 2
        orders.append(too_few)
    return orders
