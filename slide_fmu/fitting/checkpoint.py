"""A checkpoint is a file from which a training resumes; it begins with the hash of its content.

So a file damaged by a disk or a transfer is never used. The name of the file has a key of
all that decides the result of the training: its recipe, its data, the features that the system
offers, and the version of the code. The CPU time of the training so far is in another file.
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from pickle import UnpicklingError
from typing import Any, final

import torch

from slide_fmu.core.files import write_whole
from slide_fmu.core.kept import Memo
from slide_fmu.core.progress import Heard, Stages
from slide_fmu.data.stored_split import Split
from slide_fmu.features.base import Offered
from slide_fmu.fitting.errors import TrainingError

DIGEST = hashlib.sha256().digest_size
"""Length of the SHA-256 hash at the beginning of a checkpoint, in bytes."""


def write_checkpoint(path: Path, content: Mapping[str, object]) -> None:
    """Write plain values and tensors as a checkpoint; its folder is made if it does not exist."""
    buffer = io.BytesIO()
    torch.save(content, buffer)
    data = buffer.getvalue()
    write_whole(path, hashlib.sha256(data).digest() + data)


def read_checkpoint(path: Path, device: torch.device) -> Any:
    """Return the content of a checkpoint, with its tensors on the device.

    Raises:
        TrainingError: the file is damaged, or was not written by this version.
    """
    with reading(path):
        found = path.read_bytes()
        if hashlib.sha256(found[DIGEST:]).digest() != found[:DIGEST]:
            raise ValueError("it does not have the hash with which it was written")
        return torch.load(io.BytesIO(found[DIGEST:]), map_location=device, weights_only=True)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn errors of an unusable checkpoint into a TrainingError with the remedy."""
    try:
        yield
    except (RuntimeError, LookupError, TypeError, ValueError, EOFError, UnpicklingError) as error:
        raise TrainingError(
            f"checkpoint {path} cannot be read ({error}); remove it to train from the start"
        ) from error


TRAINING_VERSION = 1
"""Version of the code of all trainings. Whoever changes what a training results in raises it by 1,
so that no run goes on with a network of former code: fits of networks, companions and estimators,
heads of bounds and their calibration, and all that they call, down to features and scalings. A
change that keeps all results, such as another name or a faster loop, leaves it: checkpoints are
hours of work. ``tests/fitting/test_training_version.py`` fails where it must be raised."""


def checkpoint_key(*parts: Any) -> str:
    """Return a key for the result of a training, from values for JSON that decide it.

    Added here is what all trainings depend on: their code, torch, and the number of threads, since
    sums in another order have other last bits. The kind of processor is no part of it, although
    it may change last bits too: a run folder that moves to another machine keeps its trainings.
    """
    of_all = [TRAINING_VERSION, torch.__version__, torch.get_num_threads()]
    text = json.dumps([*of_all, *parts], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def content_of(split: Split) -> str:
    """Return a digest of a split's values: a checkpoint belongs to the data of its training."""
    total = hashlib.sha256(split.inputs.tobytes() + split.outputs.tobytes())
    if split.parameters is not None:
        total.update(split.parameters.tobytes())
    return total.hexdigest()


def machine_of(offered: Offered) -> object:
    """Return the machine's numbers that features use, since the data need not depend on them."""
    chain, law = offered.chain, dataclasses.astuple(offered.law)
    if chain is None:
        return None
    return {"law": law, **{name: values.tolist() for name, values in vars(chain).items()}}


WRITE_EVERY = 1.0
"""The time is written again after this number of seconds."""


@final
class CpuTime:
    """A CpuTime counts the seconds of this process, on all its cores, starting from a file.

    The file is next to the checkpoint of its training. A damaged file raises a DamagedFileError.
    """

    def __init__(self, place: Path) -> None:
        self._memo = Memo(place, {})
        self._before: float = self._memo.found("seconds") or 0.0
        self._begin = time.process_time()
        self._written = self._before

    @property
    def seconds(self) -> float:
        """The CPU time so far, in s."""
        return self._before + time.process_time() - self._begin

    def counted(self, stages: Stages) -> Stages:
        """Return the stages of a training; calls of their progress also write the time."""

        def keep_at_times() -> None:
            if self.seconds - self._written > WRITE_EVERY:
                self.keep()

        return lambda name: Heard(stages(name), keep_at_times)

    def keep(self) -> float:
        """Write the time to the file, and return it in s."""
        self._written = self.seconds
        self._memo.keep("seconds", self._written)
        return self._written
