"""Write the start of a training whose step is another than that of an FMU which is there already.

The network of the FMU and the companion of its error bound get step and window of a recipe. The
result is an FMU that ``training.start`` may name::

    python training/starts/other_step.py fmus/slider_crank/slider_crank.fmu \
        training/slider_crank_20ms.toml START.fmu

A state of the known network is a function of the inputs before it. So at any instant it is found
on samples that end there, which is on one of several shifted grids. At the instants of the new
step, these states follow each other by a cell with other matrices: A, B and E of this cell are
their linear least-squares fit. All other matrices stay as they are; features that are changes in a
step get the scale of the new step. Nothing is simulated: the recipe draws the motions.

The result is as good as its fit, some percent; the training that begins with it does the rest.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from slide_fmu.core.scaling import Affine
from slide_fmu.core.search_path import make_importable
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.draws import draw_inputs, split_stream
from slide_fmu.features.base import Features
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fmu.export import export_fmu, read_fmu
from slide_fmu.network.state_space.equations import ByRole, Equations, turned
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.offers import offered_features
from slide_fmu.recipe.reading import parse_recipe, read_recipe_text

MOTIONS = 24
"""Number of motions of the recipe's training that the cell is fitted to."""

RIDGE = 1e-5
"""Weight of the distance from the first guess, relative to each regressor's mean square."""

FINEST = 10_000
"""Steps are known as multiples of a second divided by a number up to this, 0.1 ms or better."""


def at_step(
    known: StateSpace, features: Features, inputs: FloatArray, ratio: Fraction, window: Window
) -> tuple[StateSpace, float]:
    """Return a network with the step of a window, which follows the states of a known one.

    Args:
        known: the network; its cell has no sub-steps, and no physical parameters.
        features: its set of features, at the new step.
        inputs: scaled inputs at the new step, (B, N, n_inputs).
        ratio: known step / new step.
        window: the window at the new step.

    Returns:
        The network; and the RMS of what its values differ, relative to that of the values.

    Raises:
        ValueError: the cell has sub-steps or parameters.
    """
    if known.polynomial is not None or known.cell.substeps != 1:
        raise ValueError("a network with parameters or sub-steps; expected one without")
    values, states, seen = _at_instants(known, inputs, ratio)
    first = max(window.n_in, round(known.n_samples * ratio) + 1)
    values, states, seen = (part[:, first:] for part in (values, states, seen))
    signals = features.along(inputs)[:, :, list(known.features.chosen)]
    old, new = known.features.scaling.invert(seen), signals[:, first:]
    factors = np.sum(old * new, (0, 1)) / np.sum(old**2, (0, 1))
    scaling = Affine(
        known.features.scaling.offset * factors, known.features.scaling.scale * factors
    )
    chosen = FeatureMap(features, known.features.chosen, scaling)
    given = chosen.along(inputs)
    cell = known.cell.with_arrays(
        {**known.cell.arrays(), **_fitted(known, given[:, first + 1 :], states, float(ratio))}
    )
    found = StateSpace(cell, window.n_in, window.n_out, chosen, known.roles, known.turned)
    off = found.run(given)[0][:, first:] - values
    return found, float(np.sqrt(np.mean(off**2) / np.mean(values**2)))


def _at_instants(
    known: StateSpace, inputs: FloatArray, ratio: Fraction
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return values, states and features of the known network at the instants of the new step.

    They are NaN where less than a window lies before them.
    """
    count, length, _ = inputs.shape
    per_old, per_new = ratio.numerator, ratio.denominator
    instants = per_new * np.arange(length)
    course = CubicSpline(instants, inputs, axis=1)
    sizes = known.n_values, len(known.cell.a), known.features.n_signals
    found = [np.full((count, length, size), np.nan) for size in sizes]
    for shift in range(per_old):
        samples = course(np.arange(shift, instants[-1] + 1, per_old))
        features = known.features.along(samples)
        inputs_by_role = ByRole.of(known.roles, np.moveaxis(features, 1, 0))
        rest = np.zeros((count, sizes[1]), np.float32)
        states = Equations(known.cell, inputs_by_role, known.turned, np).run(rest)
        values, _ = known.run(features)
        here = np.flatnonzero(instants % per_old == shift)
        there = (instants[here] - shift) // per_old
        here, there = here[there >= known.n_samples], there[there >= known.n_samples]
        for part, of in zip(found, (values, np.moveaxis(states, 0, 1), features), strict=True):
            part[:, here] = of[:, there]
    return found[0], found[1], found[2]


def _fitted(
    known: StateSpace, features: NDArray[Any], states: FloatArray, ratio: float
) -> dict[str, NDArray[np.float32]]:
    """Return A, B and E by which states follow each other, with features (B, N - 1, q)."""
    cell, n = known.cell, len(known.cell.a)
    before = states[:, :-1].reshape(-1, n)
    after = states[:, 1:].reshape(-1, n)
    rows = ByRole.of(known.roles, features.reshape(1, len(before), -1))
    equations = Equations(cell, rows, known.turned, np)
    units = np.asarray(equations.hidden_units(0, before.astype(np.float32)), dtype=np.float64)
    drive = np.asarray(rows.drive[0], dtype=np.float64)
    guess = {
        "a": np.eye(n) + (cell.a - np.eye(n)) / ratio,
        "b": cell.b / ratio,
        "e": cell.e / ratio,
    }
    matrices = {name: np.asarray(part, dtype=np.float64) for name, part in guess.items()}
    pushed = turned(units @ matrices["e"].T, rows.turn[0], known.turned, np)
    rest = after - before @ matrices["a"].T - drive @ matrices["b"].T - pushed
    for group in _groups(n, known.turned):
        blocks, wanted = [], []
        for place in range(len(group)):
            shares = _shares(units, rows.turn[0], place, len(group))
            own = np.zeros((len(before), len(group), n + drive.shape[1]))
            own[:, place] = np.concatenate([before, drive], axis=1)
            blocks.append(np.concatenate([own.reshape(len(before), -1), shares], axis=1))
            wanted.append(rest[:, group[place]])
        change = _ridge(blocks, wanted).reshape(-1)
        own, of_units = np.split(change, [len(group) * (n + drive.shape[1])])
        own = own.reshape(len(group), -1)
        matrices["a"][group] += own[:, :n]
        matrices["b"][group] += own[:, n:]
        matrices["e"][group] += of_units.reshape(len(group), -1)
    return {name: part.astype(np.float32) for name, part in matrices.items()}


def _groups(n: int, pairs: int) -> list[list[int]]:
    """Return the states that the turn mixes, together."""
    return [[2 * k, 2 * k + 1] for k in range(pairs)] + [[k] for k in range(2 * pairs, n)]


def _shares(units: FloatArray, turn: NDArray[Any], place: int, size: int) -> FloatArray:
    """Return the hidden units by which the rows of E, one after the other, push one state."""
    if size == 1:
        return units
    c, s = turn[:, :1], turn[:, 1:]
    return np.concatenate([c * units, -s * units] if place == 0 else [s * units, c * units], 1)


def _ridge(blocks: list[FloatArray], wanted: list[FloatArray]) -> FloatArray:
    """Return the least-squares solution of blocks of rows, near zero where data say little."""
    gram = sum(block.T @ block for block in blocks)
    right = sum(block.T @ part for block, part in zip(blocks, wanted, strict=True))
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    scaled = gram / scale / scale[:, None]
    return np.asarray(np.linalg.solve(scaled + RIDGE * np.eye(len(scale)), right / scale) / scale)


def write(fmu: Path, recipe_file: Path, output: Path) -> dict[str, float]:
    """Write the start; return how far each network is off, relative to the known one.

    Raises:
        FmuError, RecipeError, LoadError, ValueError: a file cannot be used, or the FMU has no
            state-space network.
    """
    known, provenance = read_fmu(fmu)
    if not isinstance(known.network, StateSpace):
        raise ValueError(f"{fmu} has a feed-forward network; expected a state-space network")
    make_importable(recipe_file.parent, Path.cwd())
    recipe = parse_recipe(read_recipe_text(recipe_file), recipe_file)
    source, window = case_of(recipe).system, recipe.window.as_window
    ratio = Fraction(known.window.step).limit_denominator(FINEST)
    ratio /= Fraction(window.step).limit_denominator(FINEST)
    offered = offered_features(recipe, source, known.input_scaling)
    drawn = [
        draw_inputs(recipe, source, split_stream(recipe, "train", index), index).inputs
        for index in range(MOTIONS)
    ]
    inputs = known.input_scaling.apply(np.stack(drawn))

    def converted(network: StateSpace) -> tuple[StateSpace, float]:
        kind = network.features.features
        features = kind.of_system(tuple(kind.blocks), offered)
        return at_step(network, features, inputs, ratio, window)

    network, off = converted(known.network)
    differences, bound = {"network": off}, known.bound
    if bound is not None:
        companion, differences["companion"] = converted(bound.companion)
        bound = replace(bound, companion=companion)
    start = replace(known, network=network, window=window, bound=bound)
    origin = {key: value for key, value in (provenance or {}).items() if key != "measured"}
    export_fmu(start, output, provenance=origin)
    return differences


def main() -> None:
    """Write the start, and say how far each network is off."""
    assert __doc__ is not None
    parser = argparse.ArgumentParser(description=__doc__.split(":", maxsplit=1)[0])
    parser.add_argument("fmu", type=Path, help="FMU with another step")
    parser.add_argument("recipe", type=Path, help="recipe with the step that the start gets")
    parser.add_argument("output", type=Path, help="where the start is written")
    given = parser.parse_args()
    for name, off in write(given.fmu, given.recipe, given.output).items():
        print(f"{name}: {100 * off:.3g} % off the known one")


if __name__ == "__main__":
    main()
