"""What `try` will say of a proposed recipe is said at once, as far as it takes little time.

That is whether the step is fine enough, and whether the system forgets where it rests: a recipe
that is refused later is of no use.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.memory.decay import recommend_window
from slide_fmu.memory.modes import spectrum
from slide_fmu.memory.step_remark import step_remark
from slide_fmu.pipeline.case_checks import guarded_case
from slide_fmu.recipe.case import Case, case_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.systems.base import Linearizable
from slide_fmu.systems.errors import SimulationError


def foreseen(text: str) -> tuple[str | None, str | None]:
    """Return what `try` will say of the step of a recipe, and why it will refuse it, or None.

    The recipe's model is found from the current folder.
    """
    case = case_of(parse_open_recipe(text, "the proposed recipe").guess)
    return guarded_case(case, _foreseen)


def _foreseen(case: Case) -> tuple[str | None, str | None]:
    try:
        of_step = step_remark(case)
    except SimulationError:  # another remark reports motions on which the system fails
        of_step = None
    return of_step, _refusal(case)


def _refusal(case: Case) -> str | None:
    """Return why no window holds the memory of a system that is linearized where it rests."""
    system, window = case.system, case.recipe.window
    if not isinstance(system, Linearizable):
        return None
    try:
        rest = system.rest_state(np.array([signal.start_value for signal in system.inputs]))
        modes = spectrum(system.linearize(rest), window.remaining_amplitude)
        recommend_window(modes.decay_time, window.step, window.n_out)
    except (ValueError, SimulationError) as error:
        return str(error)
    return None
