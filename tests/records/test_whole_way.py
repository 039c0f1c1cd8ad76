"""From a file of a test bench with troubles to blocks that can be learnt from."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slide_fmu.record_files.reading import read_records
from slide_fmu.records.division import Splitting, split_pieces
from slide_fmu.records.findings import examine
from slide_fmu.records.preparation import Preparation, prepared


def write(path: Path, length: int, seed: int, gap: int, empty: int) -> np.ndarray:
    """A German file with a gap in time and a missing input; gives road and travel."""
    rng = np.random.default_rng(seed)
    road = np.convolve(rng.normal(size=length), np.ones(5) / 5, "same")
    values = np.stack([road, 2 * road], axis=1)
    lines = ["Zeit;Weg;Federweg;Notiz", "ms;mm;mm;"]
    for k, (u, y) in enumerate(values.tolist()):
        moved = "" if k == empty else f"{u:.9f}"
        if not gap <= k < gap + 10:
            lines.append(f"{5 * k};{moved};{y:.9f};gut".replace(".", ","))
    path.write_text("\n".join(lines), encoding="cp1252")
    return values


def test_records_with_troubles_become_blocks_of_what_was_measured(tmp_path: Path) -> None:
    first = write(tmp_path / "a.csv", 1200, 0, gap=500, empty=300)
    second = write(tmp_path / "b.csv", 800, 1, gap=790, empty=100)
    paths = [str(tmp_path / name) for name in ("a.csv", "b.csv")]
    records = read_records(paths, ["Weg", "Federweg"])
    found = examine(records, ["Weg"], ["Federweg"])
    assert [(f.kind, Path(f.path).name) for f in found] == [
        ("gap", "a.csv"),
        ("empty", "a.csv"),
        ("empty", "b.csv"),
    ]
    assert "behind sample 500 (line 502, t = 2.495 s)" in found[0].message
    done = prepared(records, Preparation(("Weg",), ("Federweg",), least=150))
    assert [len(piece.trajectory.outputs) for piece in done.pieces] == [300, 199, 690, 689]
    split = split_pieces(done.pieces, Splitting(lead=40))
    for block in (*split["train"], *split["validation"], *split["test"]):
        piece = done.pieces[block.piece]
        whole = (first, second)[piece.record]
        begin = round(piece.start / 0.005) + block.start
        cut = block.cut(done.pieces)
        assert np.abs(cut.outputs[:, 0] - whole[begin : begin + len(cut.outputs), 1]).max() < 1e-8
        assert np.abs(cut.outputs[1:] - 2 * cut.inputs).max() < 1e-8
