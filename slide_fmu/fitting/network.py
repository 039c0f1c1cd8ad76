"""From trajectories to a surrogate that has its network, but neither estimator nor bound."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from slide_fmu.core.progress import Heard, Stages
from slide_fmu.core.scaling import Affine, range_scaling
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.units import behind
from slide_fmu.core.window import Window
from slide_fmu.data.store import Split, read_split
from slide_fmu.features.base import Offered
from slide_fmu.fitting.checkpoint_keys import checkpoint_key, content_of, machine_of
from slide_fmu.fitting.cpu_time import CpuTime
from slide_fmu.fitting.eigenvalues import eigenvalues_at_corners, eigenvalues_at_rest
from slide_fmu.fitting.family import FITS
from slide_fmu.fitting.feature_choice import choose_features, require_odd
from slide_fmu.fitting.feature_search import Trials, search_features
from slide_fmu.fitting.history import History
from slide_fmu.fitting.input_forecast import fit_forecast
from slide_fmu.fitting.measured_noise import digests_of, noise_of
from slide_fmu.fitting.physical import physical_of, require_chosen_features
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.settled import settled
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Source

LEARNT_BY = {"window", "network", "training", "parameters"}
"""Tables of a recipe by which its network is learnt."""
STILL = 1e-9
"""A standard deviation below this part of the range is rounding, not motion."""


MARGIN = 0.01
"""Ranges of outputs in the training are wider by this part of their width at both ends."""


@dataclass(frozen=True)
class Part:
    """A part of a surrogate is a network that is fitted to trajectories.

    Attributes:
        stage: its name in the progress and in the figures.
        split: trajectories that it learns from.
        output_scaling: from the standard deviations of these trajectories if None.
        judged_by: trajectories by which the best of the training is chosen.
    """

    stage: str
    split: str
    output_scaling: Affine | None = None
    judged_by: str = "validation"


def fit_network(
    recipe: Recipe,
    machine: tuple[Source, Offered, Surrogate | None],
    places: tuple[Path, Path],
    device: torch.device,
    progress: Stages,
    part: Part = Part("surrogate", "train"),
) -> tuple[Surrogate, dict[str, History]]:
    """Fit the surrogate without estimator and bound; places are the store and the checkpoints.

    The machine is where the data come from, what features are formed of, and the surrogate that
    the training begins with, if there is one.
    """
    system, offered, known = machine
    store, checkpoints = places
    kinds = (part.split, part.judged_by, *(["beyond"] if recipe.data.beyond else []))
    splits = [read_split(store, kind, recipe.count(kind)) for kind in kinds]
    if any(training.flip_signs for training in recipe.trainings()):
        require_symmetry((*system.inputs, *system.outputs))
    require_motion(system.inputs, splits[0].inputs)
    input_scaling = offered.scaling
    output_scaling = standard_deviation_scaling(system.outputs, splits[0])
    if known is not None:
        output_scaling = known.output_scaling
    output_scaling = part.output_scaling or output_scaling
    noise = noise_of(system, output_scaling)
    family = FITS[type(recipe.network)]
    eigenvalues = eigenvalues_at_rest(system) if family.linearized else None
    dtype = torch.float64 if family.linearized else getattr(torch, recipe.training.precision)
    window = Window(recipe.window.step, recipe.window.n_in, recipe.window.n_out)
    key = checkpoint_key(
        *(content_of(split) for split in splits),
        str(eigenvalues),
        machine_of(offered),
        *(values.tolist() for s in (input_scaling, output_scaling) for values in vars(s).values()),
        recipe.model_dump(mode="json", include=LEARNT_BY),
        *([] if known is None else [known.to_bytes().hex()]),
        *digests_of(noise),
    )
    checkpoint = checkpoints / f"surrogate-{key}.pt"
    values = [
        (input_scaling.apply(split.inputs), output_scaling.apply(split.outputs))
        for split in splits
    ]
    trials = Trials(offered, window, (splits[0], splits[1]), eigenvalues, checkpoints)
    spent = CpuTime(checkpoint.with_suffix(".cpu_seconds"))
    progress = spent.counted(progress)
    table, tried = recipe.network, dict[str, History]()
    start = None if known is None else known.network
    if isinstance(start, StateSpace):
        features = start.features
    else:
        require_chosen_features(recipe, offered, len(system.outputs))
        table, tried = search_features(recipe.network, recipe.training, trials, progress)
        features = choose_features(table.feature_names(), offered, values[0][0])
    if recipe.training.flip_signs:
        require_odd(features)

    def seen(inputs: FloatArray, outputs: FloatArray) -> tuple[torch.Tensor, torch.Tensor]:
        parts = features.along(inputs), outputs
        one, other = (torch.as_tensor(part, dtype=dtype).to(device) for part in parts)
        return one, other

    training, validation, *beyond = (seen(*pair) for pair in values)
    more = beyond[0] if beyond else None
    physical = physical_of(recipe, splits, eigenvalues_at_corners(recipe, system))
    problem = Problem(
        window, features, training, validation, checkpoint, eigenvalues, more, physical=physical
    )
    begun = start if isinstance(start, StateSpace) else None
    problem = dataclasses.replace(problem, noise=noise, start=begun)
    relative = known is None and noise is None and not getattr(recipe.training, "even_out", False)
    shown = Heard(progress(part.stage), with_error=relative)
    network, history = family.fit(problem, table, recipe.training, shown)
    history = dataclasses.replace(history, cpu_seconds=spent.keep(), relative=relative)
    signals = system.inputs, system.outputs
    surrogate = Surrogate(recipe.name, window, *signals, input_scaling, output_scaling, network)
    forecast = fit_forecast(system.inputs, splits[0].inputs, recipe.window.planned)
    ranges = learnt_ranges(splits[0].outputs)
    if forecast is not None and (recipe.system.is_record or recipe.data.substeps > 1):
        forecast = dataclasses.replace(forecast, sampled=True)
    surrogate = dataclasses.replace(surrogate, forecast=forecast, output_ranges=ranges)
    return settled(surrogate, recipe, system), {**tried, part.stage: history}


def learnt_ranges(outputs: FloatArray) -> FloatArray:
    """Return the ranges of outputs, (n_trajectories, N, n_outputs), as (n_outputs, 2) values.

    They are ``MARGIN`` of their width wider, for what a surrogate errs by.
    """
    low, high = (found(outputs, axis=(0, 1)) for found in (np.nanmin, np.nanmax))
    margin = MARGIN * (high - low)
    return np.stack([low - margin, high + margin], axis=1)


def require_symmetry(signals: tuple[Signal, ...]) -> None:
    """Refuse to flip the signs of signals whose ranges do not lie evenly about 0.

    Raises:
        ValueError: a range is not symmetric; the message names the signal.
    """
    for signal in signals:
        if signal.low != -signal.high:
            raise ValueError(
                f"flip_signs = true in a training, but the range of {signal.name!r} is "
                f"{signal.low} .. {signal.high}{behind(signal.unit)}; flipping needs ranges "
                "about 0 and "
                "a system that answers -u with -y: set flip_signs = false, or declare a "
                "symmetric range"
            )


def require_motion(signals: tuple[Signal, ...], values: FloatArray) -> None:
    """Refuse data (..., n_signals) in which a signal never moves.

    Raises:
        ValueError: nothing can be learnt about a signal, which the message names.
    """
    deviations = values.reshape(-1, len(signals)).std(axis=0)
    for signal, value in zip(signals, deviations, strict=True):
        if not value > STILL * (signal.high - signal.low):
            raise ValueError(
                f"{signal.name!r} is constant in the training data; expected it to move within "
                f"{signal.low} .. {signal.high}{behind(signal.unit)}: check data.excitation and "
                "the "
                "signal's range"
            )


def standard_deviation_scaling(signals: tuple[Signal, ...], split: Split) -> Affine:
    """Scale by the middle of the signals' ranges and the standard deviation in the data.

    Raises:
        ValueError: an output never moves.
    """
    outputs = split.outputs.reshape(-1, len(signals))
    outputs = outputs[np.isfinite(outputs).all(axis=1)]
    require_motion(signals, outputs)
    deviation = outputs.std(axis=0)
    return Affine(range_scaling(signals).offset, deviation)
