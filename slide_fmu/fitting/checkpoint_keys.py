"""To what a checkpoint belongs: the code of a training, its data, its recipe and its machine."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from pathlib import Path
from typing import Any

import torch

from slide_fmu.data.store import Split
from slide_fmu.features.base import Offered

PACKAGE = Path(__file__).parents[1]
ROOMS = (
    *("core", "features", "excitation", "network", "systems"),
    *("surrogate", "recipe", "data", "fmu", "memory", "cosim", "fitting"),
)
"""A training runs the code of these rooms: all that this one imports, directly or by others. A
test compares this list with the imports, so that no change of their code can pass unseen by the
checkpoints: an estimator's targets are errors that ``surrogate`` and ``network`` compute."""


def checkpoint_key(*parts: Any) -> str:
    """Return a key for a checkpoint: of the training's code, and of what JSON can hold."""
    text = json.dumps([_code(), *parts], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def content_of(split: Split) -> str:
    """Return a digest of a split's values: a checkpoint belongs to the data it was trained on."""
    total = hashlib.sha256(split.inputs.tobytes() + split.outputs.tobytes())
    if split.parameters is not None:
        total.update(split.parameters.tobytes())
    return total.hexdigest()


def machine_of(offered: Offered) -> object:
    """Return the numbers of the machine that features may be formed of, and data need not show."""
    chain, law = offered.chain, dataclasses.astuple(offered.law)
    if chain is None:
        return None
    return {"law": law, **{name: values.tolist() for name, values in vars(chain).items()}}


def _code() -> str:
    """Return a digest of the training's code and of torch, to which checkpoints belong."""
    total = hashlib.sha256(torch.__version__.encode())
    for room in ROOMS:
        for source in sorted((PACKAGE / room).rglob("*.py")):
            name = source.relative_to(PACKAGE).as_posix()
            total.update(name.encode() + b"\0" + source.read_bytes() + b"\0")
    return total.hexdigest()
