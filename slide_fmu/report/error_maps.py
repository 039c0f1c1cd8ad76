"""This module shows the error by amplitude and frequency of the inputs as a heat map."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from slide_fmu.core.measures import percent
from slide_fmu.core.web.charts import Cell, HeatMap
from slide_fmu.validation.error_map import ErrorMap, error_map
from slide_fmu.validation.results import Validation

TITLE = "Error by amplitude and frequency"


def error_maps(validation: Validation) -> list[HeatMap]:
    """Return the heat map of a validation; none where its trajectories are too short."""
    found = error_map(validation)
    return [] if found is None or not np.nansum(found.error) else [_map_of(found)]


def _map_of(found: ErrorMap) -> HeatMap:
    """Draw the largest amplitudes on top, and the lowest frequencies on the left."""
    text = (
        f"Relative RMSE of the worst output, in pieces of {found.seconds:.3g} s. "
        "Amplitude and frequency are those of the input that moves most in a piece."
    )
    rows = _names([100 * edge for edge in found.amplitudes[1:]], " %")
    columns = _names(found.frequencies.tolist(), "")
    known = found.error[np.isfinite(found.error) & (found.error > 0)]
    low, high = np.log(known.min()), np.log(known.max())
    cells = [
        [_cell(error, int(count), low, high) for error, count in zip(*row, strict=True)]
        for row in zip(found.error, found.pieces, strict=True)
    ]
    down, last = "part of the range", int(np.flatnonzero(found.pieces.sum(axis=1))[-1])
    rows, cells = rows[last::-1], cells[last::-1]
    return HeatMap(TITLE, text, "frequency / Hz", down, columns, rows, cells)


def _cell(error: float, count: int, low: float, high: float) -> Cell | None:
    if count == 0:
        return None
    level = (np.log(max(error, np.exp(low))) - low) / max(high - low, 1e-9)
    return Cell(percent(float(f"{error:.2g}")), float(level), f"{count} pieces")


def _names(edges: Sequence[float], unit: str) -> list[str]:
    """Name the parts between edges; the first and the last one are open."""
    texts = [f"{edge:g}" for edge in edges]
    if not texts:
        return ["all"]
    between = [f"{one} to {other}{unit}" for one, other in pairwise(texts)]
    return [f"below {texts[0]}{unit}", *between, f"above {texts[-1]}{unit}"]
