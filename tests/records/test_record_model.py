"""Records as the source of a recipe's trajectories: read, examined and prepared."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.records.model import MeasuredRecords
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.loading import load_source, load_system
from slide_fmu.systems.specification import Specification
from tests.own_records import STEP, force_and_travel, write_record
from tests.refusals import refused

FORCE = {"force": SignalTable(range=(-3.0, 3.0))}
TRAVEL = {"travel": SignalTable(range=(-9.0, 9.0))}


def specification(path: Path, **changes: object) -> Specification:
    made = Specification(str(path), {}, STEP, "record", FORCE, TRAVEL)
    return replace(made, **changes)  # type: ignore[arg-type]


def source_of(path: Path, **changes: object) -> MeasuredRecords:
    source = load_source(specification(path, **changes))
    assert isinstance(source, MeasuredRecords)
    return source


def test_record_gives_its_pieces_with_units_and_inputs_that_move(tmp_path: Path) -> None:
    source = source_of(write_record(tmp_path / "a.csv"))
    assert [(s.name, s.unit, s.hold) for s in source.inputs] == [("force", "N", "first_order")]
    outputs = [(s.name, s.unit, s.hold) for s in source.outputs]
    assert outputs == [("travel", "m", "zero_order")]  # only inputs act between samples
    assert [len(piece.trajectory.outputs) for piece in source.pieces] == [4000]
    assert (source.step, source.files) == (STEP, ("a.csv",))


def test_column_of_another_name_becomes_the_signal(tmp_path: Path) -> None:
    header = "time [s],Force at rod [kN],travel [m]"
    path = write_record(tmp_path / "a.csv", header=header)
    force = {"force": SignalTable(range=(-3.0, 3.0), column="Force at rod")}
    [signal] = source_of(path, inputs=force).inputs
    assert (signal.name, signal.unit) == ("force", "kN")
    other = {"force": force["force"].model_copy(update={"unit": "N"})}
    with refused(LoadError, "input 'force' is in N in the recipe, and in kN in", "not converted"):
        source_of(path, inputs=other)


def test_column_that_is_missing_is_named_with_the_key_that_names_another(tmp_path: Path) -> None:
    path = write_record(tmp_path / "a.csv", header="time [s],Force at rod [kN],travel [m]")
    wanted = r"it has \['time', .*'travel'\].*recipe: system.inputs.force.column = \"COLUMN\""
    with pytest.raises(LoadError, match=wanted):
        source_of(path)


def test_pairing_follows_from_the_hold_unless_it_is_said(tmp_path: Path) -> None:
    path = write_record(tmp_path / "a.csv")
    held = {"force": SignalTable(range=(-3.0, 3.0), hold="zero_order")}
    same, later = source_of(path), source_of(path, inputs=held)
    said = source_of(path, inputs=held, parameters={"pairing": "same"})
    moved = [source.pieces[0].trajectory.inputs for source in (same, later, said)]
    np.testing.assert_array_equal(moved[0], moved[2])
    np.testing.assert_array_equal(moved[0][:-1], moved[1][1:])
    assert any("pairing" in remark for remark in later.remarks)


def test_several_files_are_one_source_with_an_identity_of_all(tmp_path: Path) -> None:
    one = write_record(tmp_path / "a.csv")
    other = write_record(tmp_path / "b.csv", 3000, seed=1)
    both = source_of(one, further=(str(other),))
    assert [len(piece.trajectory.outputs) for piece in both.pieces] == [4000, 3000]
    assert [piece.record for piece in both.pieces] == [0, 1]
    before = both.identity
    write_record(other, 3000, seed=2)
    after = source_of(one, further=(str(other),)).identity
    assert before.shape == after.shape == (2, 32)
    assert np.array_equal(before[0], after[0])
    assert not np.array_equal(before[1], after[1])


def test_file_without_times_needs_a_step(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    table = np.stack(force_and_travel(500), axis=1)
    np.savetxt(path, table, "%.6g", ",", header="force,travel", comments="")
    with refused(LoadError, "has no column of times"):
        source_of(path)
    assert source_of(path, parameters={"sample_step": STEP}).step == STEP


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"parameters": {"clock": "t"}}, r"unknown parameters \['clock'\]; expected some of"),
        ({"parameters": {"pairing": "next"}}, "pairing = 'next'; expected one of"),
        ({"parameters": {"sample_step": "fast"}}, "sample_step = 'fast'; expected the step"),
        ({"inputs": {}}, "names no inputs; expected at least one column"),
        ({"outputs": {"speed": SignalTable(range=(0.0, 1.0))}}, "speed"),
        ({"outputs": {"travel": SignalTable()}}, "output 'travel' has no range"),
        ({"further": ("nowhere.csv",)}, "nowhere.csv"),
        ({"step": None}, "sample step None"),
    ],
)
def test_specification_that_does_not_fit_is_refused(
    tmp_path: Path, changes: dict[str, object], message: str
) -> None:
    with pytest.raises(LoadError, match=message):
        source_of(write_record(tmp_path / "a.csv"), **changes)


def test_what_must_be_mended_first_is_refused_with_its_place(tmp_path: Path) -> None:
    path = write_record(tmp_path / "a.csv")
    lines = path.read_text().splitlines()
    lines[100] = lines[100].rsplit(",", 1)[0] + ",broken"
    path.write_text("\n".join(lines))
    with refused(LoadError, "travel", "broken"):
        source_of(path)


def test_record_cannot_be_simulated(tmp_path: Path) -> None:
    with refused(LoadError, "expected a model", "a.csv' cannot"):
        load_system(specification(write_record(tmp_path / "a.csv")))
