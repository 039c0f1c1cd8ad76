"""Result files of Modelica tools and files of numpy are read; names with numbers are names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from slide_fmu.record_files.reading import read_record
from slide_fmu.record_files.record import NoTimesError, RecordError
from slide_fmu.record_files.table import named
from tests.records.files import ROAD, TIME, TRAVEL
from tests.refusals import refused


def characters(texts: list[str], is_transposed: bool = False) -> np.ndarray:
    """A matrix of characters, whose rows are the texts, or its columns."""
    width = max(map(len, texts))
    rows = [text.ljust(width) for text in texts]
    return np.array(
        ["".join(column) for column in zip(*rows, strict=True)] if is_transposed else rows
    )


def write_result(path: Path, is_transposed: bool) -> None:
    """A result of 200 samples, with an event at the fifth, as Dymola or OpenModelica write it."""
    at = np.insert(np.arange(200), 5, 4)
    moving = np.stack([TIME, ROAD, TRAVEL], axis=1)[at]
    moving[4, 1] = 77.0  # before the event
    info = np.array([[0, 1, 0, -1], [1, 2, 0, 0], [2, 2, 0, -1], [2, -2, 0, -1], [2, 3, 0, -1]])
    about = ["Time [s]", "Mass [kg]", "Road [m|mm]", "", "Travel of arm [m]"]
    tables = {"dataInfo": info, "data_1": np.array([[0.0, 2.0], [1.0, 2.0]]), "data_2": moving}
    content = {
        "Aclass": characters(
            ["Atrajectory", "1.1", "", "binTrans" if is_transposed else "binNormal"]
        ),
        "name": characters(["time", "mass", "road", "minus", "arm.x[1]"], is_transposed),
        "description": characters(about, is_transposed),
        **{name: values.T if is_transposed else values for name, values in tables.items()},
    }
    savemat(path, content, format="4")


@pytest.mark.parametrize("is_transposed", [True, False])
def test_result_file_of_a_modelica_tool_is_read(tmp_path: Path, is_transposed: bool) -> None:
    write_result(tmp_path / "a.mat", is_transposed)
    record = read_record(str(tmp_path / "a.mat"))
    assert np.array_equal(record.time, TIME)
    assert record.units == {"road": "m", "minus": "", "arm.x[1]": "m"}
    assert np.array_equal(record.columns["road"], ROAD)
    assert np.array_equal(record.columns["minus"], -ROAD)
    assert np.array_equal(record.columns["arm.x[1]"], TRAVEL)
    with refused(RecordError, "['mass'] are constants of the simulation"):
        read_record(str(tmp_path / "a.mat"), ["mass"])
    with refused(RecordError, "no columns ['speed']"):
        read_record(str(tmp_path / "a.mat"), ["speed"])


def test_files_of_numpy_are_read(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.stack([TIME, ROAD, TRAVEL], axis=1))
    record = read_record(str(tmp_path / "a.npy"), ["column_2", "column_3"], time="column_1")
    assert np.array_equal(record.time, TIME)
    assert np.array_equal(record.columns["column_3"], TRAVEL)
    with pytest.raises(NoTimesError, match="name it with time, or give the step"):
        read_record(str(tmp_path / "a.npy"))
    fields = np.rec.fromarrays([TIME, ROAD], names="time,road")
    np.save(tmp_path / "b.npy", np.asarray(fields))
    assert np.array_equal(read_record(str(tmp_path / "b.npy")).columns["road"], ROAD)
    np.savez(tmp_path / "a.npz", time=TIME, road=ROAD)
    assert np.array_equal(read_record(str(tmp_path / "a.npz")).columns["road"], ROAD)


@pytest.mark.parametrize("name", ["a.npy", "a.npz"])
def test_file_of_numpy_with_objects_or_another_content_is_refused(
    tmp_path: Path, name: str
) -> None:
    np.save(tmp_path / "a.npy", np.array([{}, None]), allow_pickle=True)
    np.savez(tmp_path / "a.npz", time=np.array([{}, None]), allow_pickle=True)
    with refused(RecordError, name, "it has objects", "expected a file of numpy that is whole"):
        read_record(str(tmp_path / name))
    (tmp_path / name).write_bytes(b"what is this, a record?" * 9)
    with refused(RecordError, name, "expected a file of numpy that is whole"):
        read_record(str(tmp_path / name))


def test_times_that_are_not_as_many_as_the_samples_are_named(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", time=TIME[:-3], road=ROAD, travel=TRAVEL)
    with refused(RecordError, "has 197 times 'time' for 200 samples", "--time none --step"):
        read_record(str(tmp_path / "a.npz"), ["road", "travel"])
    np.savez(tmp_path / "a.npz", time=TIME[:-3], t=TIME, road=ROAD)
    assert read_record(str(tmp_path / "a.npz"), ["road"]).clock == "t"


def test_number_in_brackets_behind_a_name_is_part_of_it() -> None:
    header = ["q[0]", "q[1] [rad]", "M(1,2)", "slip [1]", "road[m]", "x (mm)"]
    units = {"q[0]": "", "q[1]": "rad", "M(1,2)": "", "slip": "1", "road": "m", "x": "mm"}
    assert named(header, "a.csv") == units
