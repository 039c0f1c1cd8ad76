"""What the samples of a recipe's step cannot show of its excitation."""

from __future__ import annotations

import math

from slide_fmu.recipe.recipe import Recipe


def remarks_on_sampling(recipe: Recipe) -> list[str]:
    """Say which kinds of excitation ask for frequencies that samples cannot show.

    There is one sentence for each of them. Sampled, a sine beyond the frequency of Nyquist, which
    is pi over the step, becomes a slower one.
    """
    tables = {
        "data": recipe.data.excitation,
        "bound": recipe.further_kinds(),
        "validation": recipe.validation.excitation,
    }
    limit = math.pi / recipe.window.step
    return [
        f"{table}.excitation, number {number} ({kind.kind}): angular_frequency up to {highest:g} "
        f"rad/s, but samples that are {recipe.window.step:g} s apart show at most {limit:.4g} "
        "rad/s; faster vibrations become slower ones: lower it, or give a smaller window.step"
        for table, kinds in tables.items()
        for number, kind in enumerate(kinds, 1)
        for highest in [max(getattr(kind, "angular_frequency", None) or (0.0,))]
        if highest > limit
    ]
