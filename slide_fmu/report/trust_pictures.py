"""The picture of how far error bounds hold by kind of excitation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from slide_fmu.report.panels import ERROR, REFERENCE, SURROGATE, panels_in_a_row
from slide_fmu.report.pictures import png as _png
from slide_fmu.surrogate.error_bound import USUAL_CONFIDENCE
from slide_fmu.validation.comparison import Validation
from slide_fmu.validation.motions import motions_of
from slide_fmu.validation.worst_steps import error_over_bound


def coverage_by_kind(validations: Mapping[str, Validation]) -> bytes:
    """Draw the covered share of every trajectory by kind of excitation, the least of the outputs.

    The line of a kind is the mean of its trajectories.
    """
    kinds = {name: motions_of(v.recipe) for name, v in validations.items()}
    figure, axes = panels_in_a_row(len(validations), 1.4 + 0.42 * max(map(len, kinds.values())))
    for ax, (title, validation) in zip(axes, validations.items(), strict=True):
        labels, names = [], [motion.name for motion in kinds[title]]
        for row, name in enumerate(names):
            chosen = [c for c in validation.trusted if c.kind == row]
            labels.append(f"{name} ({len(chosen)})")
            shares = [100 * float((error_over_bound(c) <= 1).mean(axis=0).min()) for c in chosen]
            if shares:
                mean = float(np.mean(shares))
                ax.plot([mean, mean], [row - 0.34, row + 0.34], color=ERROR, lw=2)
                heights = row + np.linspace(-0.22, 0.22, len(shares) + 2)[1:-1]
                ax.plot(shares, heights, ".", color=SURROGATE, ms=6, alpha=0.8)
        ax.axvline(100 * USUAL_CONFIDENCE, color=REFERENCE, ls="--", lw=1)
        ax.set_yticks(range(len(names)), labels)
        ax.set(ylim=(len(names) - 0.5, -0.5), title=title)
        ax.set_xlabel("covered samples / %\n(dot: trajectory, red: mean, dashed: confidence)")
    return _png(figure)
