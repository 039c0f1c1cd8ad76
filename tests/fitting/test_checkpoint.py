"""Checkpoints that were damaged after they were written."""

from pathlib import Path

import numpy as np
import pytest
import torch

from slide_fmu.core.result_cache import DamagedFileError
from slide_fmu.fitting.checkpoint import read_checkpoint, write_checkpoint
from tests.refusals import refused

CPU = torch.device("cpu")


def test_checkpoint_holds_what_was_written(tmp_path: Path) -> None:
    path = tmp_path / "new folder" / "x.pt"
    write_checkpoint(path, {"step": 3, "weights": torch.arange(5.0)})
    found = read_checkpoint(path, CPU)
    assert found["step"] == 3
    assert found["weights"].tolist() == [0, 1, 2, 3, 4]


def test_checkpoint_with_one_flipped_bit_is_refused_wherever_it_is(tmp_path: Path) -> None:
    path = tmp_path / "x.pt"
    write_checkpoint(path, {"weights": torch.arange(50.0)})
    whole = path.read_bytes()
    for place in np.linspace(0, len(whole) - 1, 60).astype(int):
        broken = bytearray(whole)
        broken[place] ^= 1 << (place % 8)
        path.write_bytes(broken)
        with refused(DamagedFileError, "x.pt is damaged", "hash", "remove it to train"):
            read_checkpoint(path, CPU)


@pytest.mark.parametrize("part", [0.0, 0.3, 0.99])
def test_checkpoint_that_was_cut_short_is_refused(tmp_path: Path, part: float) -> None:
    path = tmp_path / "x.pt"
    write_checkpoint(path, {"weights": torch.arange(50.0)})
    whole = path.read_bytes()
    path.write_bytes(whole[: int(part * len(whole))])
    with refused(DamagedFileError, "x.pt is damaged", "hash", "remove it to train"):
        read_checkpoint(path, CPU)
