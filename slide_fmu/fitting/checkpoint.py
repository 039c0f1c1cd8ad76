"""A checkpoint is a file from which a training goes on; it begins with the hash of what follows.

So a file that a disk or a transfer has damaged is never taken for the training it was.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from pickle import UnpicklingError
from typing import Any

import torch

from slide_fmu.core.files import write_whole
from slide_fmu.fitting.errors import TrainingError

DIGEST = hashlib.sha256().digest_size
"""Bytes of the SHA-256 hash with which a checkpoint begins."""


def write_checkpoint(path: Path, content: dict[str, Any]) -> None:
    """Write plain values and tensors as checkpoint; its folder is made where there is none."""
    buffer = io.BytesIO()
    torch.save(content, buffer)
    data = buffer.getvalue()
    write_whole(path, hashlib.sha256(data).digest() + data)


def read_checkpoint(path: Path, device: torch.device) -> Any:
    """Return what a checkpoint holds, its tensors on the device.

    Raises:
        TrainingError: the file is damaged, or is none that this version has written.
    """
    with reading(path):
        found = path.read_bytes()
        if hashlib.sha256(found[DIGEST:]).digest() != found[:DIGEST]:
            raise ValueError("it does not have the hash with which it was written")
        return torch.load(io.BytesIO(found[DIGEST:]), map_location=device, weights_only=True)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn what a checkpoint that cannot be used raises into a TrainingError with the remedy."""
    try:
        yield
    except (RuntimeError, LookupError, TypeError, ValueError, EOFError, UnpicklingError) as error:
        raise TrainingError(
            f"checkpoint {path} cannot be read ({error}); remove it to train from the start"
        ) from error
