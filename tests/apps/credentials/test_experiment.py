"""Experiments as files of an FMU, and tables as CSV."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.apps.credentials import members
from slide_fmu.apps.credentials.experiment import Experiment, experiment_members, read_experiment
from slide_fmu.apps.credentials.schema import CredentialError
from slide_fmu.apps.credentials.tables import read_table, rounded, write_table
from slide_fmu.core.files import write_zip

EXPERIMENT = Experiment(
    0.1,
    {"u": np.array([1.0, -2.5, 3.0])},
    {"y": np.array([0.0, 1.0, 2.0, 3.0]), "window_filled": np.array([0.0, 0.5, 1.0, 1.0])},
    {"y": np.array([1.5, 4.0])},
    {"mass": 2.5},
)


def written(tmp_path: Path, **others: bytes | None) -> Path:
    """An archive with the files of the experiment; some are replaced, or missing if None."""
    files: dict[str, bytes | None] = {**experiment_members(EXPERIMENT)}
    files |= {getattr(members, name): content for name, content in others.items()}
    path = tmp_path / "plant.fmu"
    write_zip(path, {name: content for name, content in files.items() if content is not None})
    return path


def test_read_experiment_gives_what_was_written(tmp_path: Path) -> None:
    read = read_experiment(written(tmp_path))
    assert read is not None
    assert (read.step, read.steps, read.compared) == (0.1, 3, 2)
    assert read.parameters == {"mass": 2.5}
    for kind in ("inputs", "results", "reference"):
        for name, values in getattr(EXPERIMENT, kind).items():
            np.testing.assert_array_equal(getattr(read, kind)[name], values)


def test_archive_without_experiment_has_none(tmp_path: Path) -> None:
    write_zip(tmp_path / "plant.fmu", {"a": b""})
    assert read_experiment(tmp_path / "plant.fmu") is None


def test_inputs_last_until_the_end_for_importers_that_interpolate() -> None:
    time, columns = read_table(experiment_members(EXPERIMENT)[members.INPUTS], "inputs.csv")
    np.testing.assert_allclose(time, [0.0, 0.1, 0.2, 0.3])
    np.testing.assert_array_equal(columns["u"], [1.0, -2.5, 3.0, 3.0])


def test_relative_error_is_that_of_the_samples_at_which_the_reference_is_known() -> None:
    deviation = (4.0 - 1.5) / 2
    expected = np.sqrt((0.5**2 + 1.0**2) / 2) / deviation
    assert EXPERIMENT.relative_errors() == {"y": pytest.approx(expected)}
    with_gap = Experiment(
        0.1, EXPERIMENT.inputs, EXPERIMENT.results, {"y": np.array([np.nan, 1.5, 4.0])}
    )
    assert with_gap.relative_errors() == EXPERIMENT.relative_errors()


@pytest.mark.parametrize(
    ("others", "message"),
    [
        (
            {"INPUTS": None},
            r"inputs.csv is missing; .*experiments.exp needs it",
        ),
        ({"EXPERIMENTS": b"<Experiments/>"}, r"experiments.exp, line 1: .*schema"),
        ({"INPUTS": b"time,u\n0,1\n0.1,2\n"}, "2 times of inputs and 4 of results"),
        ({"RESULTS": b"time,y\n0,1\n0.2,2\n0.4,1\n0.6,1\n"}, "expected the same times in both"),
        ({"REFERENCE_MODEL": b"time,z\n0,1\n"}, r"has the columns \['z'\]"),
        ({"RESULTS": b"time,y\n0,one\n"}, "results.csv, line 2: could not convert"),
        ({"PARAMETERS": b"<a/>"}, "expected an SSV file"),
    ],
)
def test_damaged_experiment_is_refused_by_name(
    tmp_path: Path, others: dict[str, bytes | None], message: str
) -> None:
    with pytest.raises(CredentialError, match=message):
        read_experiment(written(tmp_path, **others))


def test_table_keeps_nine_digits_of_values_and_all_of_times() -> None:
    time, values = np.array([1 / 3, 2 / 3]), np.array([np.pi * 1e-7, -1 / 3])
    found, columns = read_table(write_table(time, {"a,b": values}), "x.csv")
    np.testing.assert_array_equal(found, time)
    np.testing.assert_array_equal(columns["a,b"], rounded(values))
    np.testing.assert_allclose(columns["a,b"], values, rtol=1e-8)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\xff\xfe", "is no CSV file"),
        (b"t,u\n0,1\n", "expected names of two or more columns"),
        (b"time,u\n", "has 1 lines"),
        (b"time,u\n0,1,2\n", "line 2 has 3 values; expected 2"),
    ],
)
def test_damaged_table_is_refused_by_name(content: bytes, message: str) -> None:
    with pytest.raises(CredentialError, match=f"x.csv.*{message}"):
        read_table(content, "x.csv")
