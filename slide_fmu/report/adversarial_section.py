"""The section of a report on the search for inputs with which the surrogate errs unnoticed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from slide_fmu.core.units import labelled
from slide_fmu.report.pictures import png
from slide_fmu.report.report import Section
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.adversarial import Attack, attack_figures
from slide_fmu.validation.trust import BROKEN

SHOWN = 120
"""So many samples stand before the worst one in the picture, and a fourth of them after it."""


def adversarial_section(attacks: Sequence[Attack], surrogate: Surrogate) -> Section:
    """Show what the search found, and the worst of it."""
    worst = max(attacks, key=lambda found: found.after)
    assert surrogate.bound is not None
    figures = attack_figures(attacks, surrogate.bound.confidences[-1])
    return search_section(figures, [_picture(worst, surrogate)])


def search_section(figures: Mapping[str, Any], pictures: Sequence[bytes] = ()) -> Section:
    """Show the figures of a search (``attack_figures``)."""
    usual, highest = figures["confidences"]
    rows = [("error over its bound, largest in the domain", "median", "worst", "broken")]
    for name, text in (
        ("before", f"unseen trajectories, confidence {usual:g}"),
        ("after", f"after the search, confidence {usual:g}"),
        ("after_highest", f"after the search, confidence {highest:g}"),
    ):
        ratios = np.array(figures[name])
        broken = f"{np.sum(ratios > BROKEN)} of {len(ratios)}"
        rows.append((text, f"{np.median(ratios):.3g}", f"{ratios.max():.3g}", broken))
    text = (
        f"A search changes the inputs of {figures['starts']} unseen trajectories within their "
        f"ranges ({figures['changes_tried']} changes are tried of each) so that an error becomes "
        "large beside its bound "
        "while the FMU counts the inputs as those of its domain. Beside a bound of 95 % one step "
        "in twenty errs more anyway; a bound counts as broken where the error is more than "
        f"{BROKEN:g} times as large."
    )
    return Section("Search for unnoticed errors", text, rows, pictures)


def _picture(found: Attack, surrogate: Surrogate) -> bytes:
    """Draw the inputs before the worst step, the errors, and what the FMU says of them."""
    first = max(0, found.step - SHOWN)
    shown = slice(first, found.step + SHOWN // 4)
    time = surrogate.window.step * np.arange(first, first + len(found.inputs[shown]))
    relative = (found.errors / found.bounds)[found.step]
    output = int(np.argmax(relative))
    signal = surrogate.outputs[output]
    figure = Figure(figsize=(9, 4.5), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1, 1.6))
    for index, one in enumerate(surrogate.inputs):
        upper.step(time, found.inputs[shown, index], where="post", lw=0.9, label=one.name)
    upper.set_ylabel("inputs")
    upper.set_title(f"the worst start: error {found.after:.3g} times its bound", fontsize=11)
    lower.plot(time, found.errors[shown, output], color="#d62728", label="|error|")
    lower.plot(time, found.bounds[shown, output], color="#ff7f0e", label="bound")
    outside = ~found.in_domain[shown]
    if outside.any():
        top = max(found.errors[shown, output].max(), found.bounds[shown, output].max())
        lower.fill_between(time, 0, top, where=outside, alpha=0.15, label="outside of the domain")
    lower.set(xlabel="time / s", ylabel=labelled(f"error of {signal.name}", signal.unit))
    lower.legend(loc="upper left", fontsize=8)
    return png(figure)
