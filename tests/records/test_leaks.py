"""No part of measured records scores inputs that another part scores, however often they come."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.parts import most_blocks, scored_parts
from slide_fmu.records.remarks import remarks_on_division
from tests.own_records import RECIPE, STEP

EDGE = 3
"""So many samples around the place where one input gives way to another may count to either."""
PERIOD, LENGTH = 400, 4000
WAVES = np.random.default_rng(0).normal(size=(12, PERIOD))
DRIVES = np.random.default_rng(1).normal(size=(6, LENGTH))


@dataclass(frozen=True)
class Case:
    """Files of inputs, and what each sample of them is.

    Attributes:
        inputs: of each file, shape (N,).
        names: number of the input at each sample of each file: the same where it comes again.
        data: what the recipe says of the division.
        masses: of the specimens in the files; none if they are all of one.
        fewest: so many different inputs are scored in each part, at least.
    """

    inputs: tuple[np.ndarray, ...]
    names: tuple[np.ndarray, ...]
    data: str
    masses: tuple[float, ...] = ()
    fewest: int = 150


def numbered(waves: np.ndarray, order: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    length = waves.shape[1]
    names = np.arange(waves.size).reshape(waves.shape)
    return waves[list(order)].reshape(-1), names[list(order)].reshape(len(order) * length)


def periods(waves: np.ndarray, *order: int, before: int = 0) -> Case:
    """One file of waves one after the other, which begins so many samples after the first."""
    inputs, names = numbered(waves, order)
    return Case((inputs[before:],), (names[before:],), "")


def files(data: str, *drives: int, masses: tuple[float, ...] = (), offset: int = 0) -> Case:
    """One file for each drive, which begins so many samples later than the file before."""
    made = [numbered(DRIVES, (drive,)) for drive in drives]
    inputs = tuple(values[n * offset :] for n, (values, _) in enumerate(made))
    names = tuple(found[n * offset :] for n, (_, found) in enumerate(made))
    return Case(inputs, names, data, masses)


CASES: dict[str, Callable[[], Case]] = {
    "one record": lambda: files("", 0),
    "files of other inputs": lambda: files('by = "record"', 0, 1, 2),
    "periods twice each": lambda: periods(WAVES, *(k // 2 for k in range(20))),
    "periods that come again later": lambda: periods(WAVES, *[0, 1, 2, 3, 4, 5] * 3),
    "cut in a period": lambda: periods(WAVES, *(k // 2 for k in range(20)), before=170),
    "three periods": lambda: periods(WAVES, *(k // 6 for k in range(18))),
    "one long period": lambda: periods(DRIVES[:, :2000], *[0] * 5),
    "alike files end to end": lambda: files("", 0, 1, 0, 2),
    "one drive from other samples on": lambda: files("", 0, 0, 0, offset=700),
    "each of one drive from other samples on": lambda: files('by = "each"', 0, 0, offset=700),
    "files of alike inputs": lambda: files('by = "record"', 0, 0, 1, 2),
    "alike files apart": lambda: files('by = "record"', 0, 1, 0, 2, 3, 1),
    "files together": lambda: files('by = "each"', 0, 0),
    "specimens of one drive": lambda: files("", 0, 0, 0, masses=(1.0, 2.2, 1.5)),
    "specimens": lambda: files("", 0, 1, 2, masses=(1.0, 2.2, 1.5)),
}


def recipe_of(folder: Path, case: Case) -> Recipe:
    rng, paths = np.random.default_rng(2), []
    for number, values in enumerate(case.inputs):
        force = values + 1e-3 * rng.normal(size=len(values))
        travel = lfilter([0.1], [1, -0.9], force)
        table = np.stack([STEP * np.arange(len(force)), force, travel], axis=1)
        path = folder / f"{number}.csv"
        np.savetxt(path, table, "%.9g", ",", header="time [s],force [N],travel [m]", comments="")
        paths.append(path.as_posix())
    model = f'model = "{paths[0]}"\nfurther = {paths[1:]}'
    text = RECIPE.replace('model = "bench.csv"', model).replace("n_in = 240", "n_in = 60")
    text = text.replace("n_out = 80", "n_out = 20")
    text = text.replace("range = [-3.0, 3.0]", "range = [-9.0, 9.0]") + f"\n[data]\n{case.data}\n"
    if case.masses:
        text += f"[parameters.mass]\nvalues = {list(case.masses)}\n"
    resolved = {"data": {"duration": 1.0, "burn_in": 0.4}}
    return parse_open_recipe(text, "bench.toml").with_found(resolved, "bench.toml").guess


@pytest.mark.parametrize("name", CASES)
def test_no_input_is_scored_in_two_parts(tmp_path: Path, name: str) -> None:
    case = CASES[name]()
    recipe = recipe_of(tmp_path, case)
    source = case_of(recipe).source
    assert isinstance(source, MeasuredRecords)
    found = {}
    for part, blocks in scored_parts(recipe, source).items():
        # the input that output k + 1 answers is that of sample k + 1
        found[part] = np.concatenate(
            [case.names[source.pieces[b.piece].record][b.scored + 1 : b.stop + 1] for b in blocks]
        )
    for one, other in combinations(found.values(), 2):
        places = len(case.inputs) * most_blocks(recipe, source)
        assert len(set(one) & set(other)) <= EDGE * places
    for part, names in found.items():
        assert len(set(names)) >= case.fewest, part


@pytest.mark.parametrize("name", CASES)
def test_nothing_is_learnt_from_that_still_answers_what_is_tested(
    tmp_path: Path, name: str
) -> None:
    recipe = recipe_of(tmp_path, CASES[name]())
    source = case_of(recipe).source
    assert isinstance(source, MeasuredRecords)
    parts = scored_parts(recipe, source)
    lead = recipe.window.n_in - recipe.window.n_out
    for number, piece in enumerate(source.pieces):
        tested = np.zeros(len(piece.trajectory.inputs), bool)
        for block in parts["test"]:
            if block.piece == number:
                tested[block.scored : block.stop] = True
        for block in parts["train"]:
            if block.piece == number:
                assert not tested[block.scored - lead : block.stop].any()


def test_one_short_period_is_tested_as_known(tmp_path: Path) -> None:
    """Its last 15 % are shorter than what a window truncates."""
    recipe = recipe_of(tmp_path, periods(WAVES[:, :200], *[0] * 20))
    source = case_of(recipe).source
    assert isinstance(source, MeasuredRecords)
    remark = " ".join(remarks_on_division(recipe, source))
    assert "95 % of the inputs come again, mostly 2 s (200 samples) later" in remark
    assert "the error says nothing about other inputs" in remark
    assert len(scored_parts(recipe, source)["test"]) == 1
