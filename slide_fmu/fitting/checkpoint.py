"""A checkpoint is a file from which a training resumes.

The name of the file has a key of all that decides the result of the training: its recipe, its
data, the features that the system offers, and the version of the code. The CPU time of the
training so far is in another file.
"""

from __future__ import annotations

import io
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from pickle import UnpicklingError
from typing import Any, final

import torch

from slide_fmu.core.progress import ProgressListener, Stages
from slide_fmu.core.result_cache import ResultFile, key_of
from slide_fmu.fitting.errors import TrainingError

REMEDY = "remove it to train from the start"
"""What the user can do about a checkpoint that cannot be used."""


def write_checkpoint(path: Path, content: Mapping[str, object]) -> None:
    """Write plain values and tensors as a checkpoint; its folder is made if it does not exist."""
    buffer = io.BytesIO()
    torch.save(content, buffer)
    ResultFile(path).write(buffer.getvalue())


def read_checkpoint(path: Path, device: torch.device) -> Any:
    """Return the content of a checkpoint, with its tensors on the device; None if there is none.

    Raises:
        DamagedFileError: the file has changed since it was written.
        TrainingError: the file was not written by this version.
    """
    content = ResultFile(path, REMEDY).read()
    if content is None:
        return None
    with reading(path):
        return torch.load(io.BytesIO(content), map_location=device, weights_only=True)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn errors of a checkpoint that another version wrote into one with the remedy."""
    try:
        yield
    except (RuntimeError, LookupError, TypeError, ValueError, EOFError, UnpicklingError) as error:
        raise TrainingError(f"checkpoint {path} cannot be read ({error}); {REMEDY}") from error


TRAINING_VERSION = 6
"""Version of the code of all trainings. Whoever changes what a training results in raises it by 1,
so that no run goes on with a network of former code: fits of networks, companions and estimators,
heads of bounds and their calibration, and all that they call, down to features and scalings. A
change that keeps all results, such as another name or a faster loop, leaves it: checkpoints are
hours of work. ``tests/fitting/test_training_version.py`` fails where it must be raised."""


def checkpoint_key(*decides: object, threads: int | None = None) -> str:
    """Return the key of the result of a training, from what decides it (``key_of``).

    Added here is what all trainings depend on: their code, torch, and the number of threads, since
    sums in another order have other last bits. The kind of processor is no part of it, although
    it may change last bits too: a run folder that moves to another machine keeps its trainings.

    Args:
        decides: what decides the result of this training.
        threads: the number of threads; if None, that of torch now.
    """
    threads = torch.get_num_threads() if threads is None else threads
    return key_of(TRAINING_VERSION, torch.__version__, threads, decides)


WRITE_EVERY = 1.0
"""The time is written again after this number of seconds."""


@final
class CpuTime:
    """A CpuTime counts the seconds of this process, on all its cores, starting from a file.

    The file is next to the checkpoint of its training. A damaged file raises a DamagedFileError.
    """

    def __init__(self, place: Path) -> None:
        self._file = ResultFile(place)
        self._before = self._file.read_json(float) or 0.0
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

        return lambda name: ProgressListener(stages(name), keep_at_times)

    def keep(self) -> float:
        """Write the time to the file, and return it in s."""
        self._written = self.seconds
        self._file.write_json(self._written)
        return self._written
