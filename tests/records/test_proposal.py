"""A first recipe is proposed for records of the user, and is tried."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.signal import lfilter
from typer.testing import CliRunner, Result

from slide_fmu.cli.app import app
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.record_files.reading import read_records
from slide_fmu.record_files.record import RecordError
from slide_fmu.records.findings import examine
from slide_fmu.records.proposal import RecordOptions, chosen_columns, propose_record, read_chosen
from tests.own_records import STEP, force_and_travel, write_record
from tests.refusals import refused


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def recipe_for(path: Path, **options: object) -> Recipe:
    wished = RecordOptions((str(path),), inputs={"force": None}, **options)  # type: ignore[arg-type]
    return parse_open_recipe(propose_record(wished).text, "proposed").guess


def write_columns(path: Path, **columns: np.ndarray) -> Path:
    table = np.stack(list(columns.values()), axis=1)
    np.savetxt(path, table, "%.9g", ",", header=",".join(columns), comments="")
    return path


def test_proposed_recipe_has_columns_units_ranges_and_the_step(tmp_path: Path) -> None:
    recipe = recipe_for(write_record(tmp_path / "bench test.csv", noise=0.01))
    force, travel = recipe.system.inputs["force"], recipe.system.outputs["travel"]
    assert (recipe.name, recipe.system.kind, recipe.window.step) == ("bench_test", "record", STEP)
    assert (force.unit, travel.unit, force.hold) == ("N", "m", "first_order")
    measured = force_and_travel(4000)[0]
    assert force.range is not None
    assert force.range[0] <= measured.min() < measured.max() <= force.range[1]
    assert np.ptp(force.range) < 1.05 * np.ptp(measured)
    assert recipe.estimator is None  # there are few samples


def test_columns_that_would_be_one_signal_are_named(tmp_path: Path) -> None:
    header = "time [s],force,a (left) [m]"
    path = write_record(tmp_path / "a.csv", header=header)
    lines = path.read_text().splitlines()
    more = ["a_left", *(f"{k}" for k in range(len(lines) - 1))]
    path.write_text("\n".join(f"{line},{one}" for line, one in zip(lines, more, strict=True)))
    with refused(RecipeError, "columns 'a (left)' and 'a_left' would both be the signal 'a_left'"):
        recipe_for(path)


def test_values_that_are_infinite_are_no_part_of_a_range(tmp_path: Path) -> None:
    force, travel = force_and_travel(4000)
    force[100] = -np.inf
    path = write_columns(
        tmp_path / "a.csv", time=STEP * np.arange(4000), force=force, travel=travel
    )
    low, high = recipe_for(path).system.inputs["force"].range or (0.0, 0.0)
    assert -10 < low < high < 10


def test_long_record_gets_an_error_estimator(tmp_path: Path) -> None:
    assert recipe_for(write_record(tmp_path / "a.csv", 20_000)).estimator is not None


def test_names_that_no_signal_can_have_are_replaced_and_keep_their_column(tmp_path: Path) -> None:
    header = "time [s],force,Travel of rod (left) [m]"
    recipe = recipe_for(write_record(tmp_path / "a.csv", header=header))
    [(name, signal)] = recipe.system.outputs.items()
    assert (name, signal.column) == ("Travel_of_rod_left", "Travel of rod (left)")


def test_held_inputs_are_found_by_when_outputs_answer(tmp_path: Path) -> None:
    force, travel = force_and_travel(4000, bend=0.0)
    noisy = travel[:-1] + 0.001 * np.random.default_rng(0).normal(size=3999)
    time = STEP * np.arange(3999)
    recipe = recipe_for(
        write_columns(tmp_path / "a.csv", time=time, force=force[1:], travel=noisy)
    )
    assert recipe.system.inputs["force"].hold == "zero_order"


def test_file_without_times_needs_the_step_and_keeps_it(tmp_path: Path) -> None:
    force, travel = force_and_travel(4000)
    path = write_columns(tmp_path / "a.csv", force=force, travel=travel)
    with refused(RecipeError, "--time NAME, or --step SECONDS"):
        recipe_for(path)
    recipe = recipe_for(path, step=0.02)
    assert recipe.system.parameters == {"sample_step": 0.02}
    assert recipe.window.step == 0.02


def test_record_that_is_too_short_for_its_memory_is_refused_with_the_length_it_needs(
    tmp_path: Path,
) -> None:
    path = write_record(tmp_path / "a.csv", 300)
    price = "and leaves 50 % of what happened before it: a truncation error of up to 50 %"
    with refused(RecipeError, "the records have 299 samples (2.99 s)", "at least", price):
        recipe_for(path)


def test_record_of_two_samples_is_refused(tmp_path: Path) -> None:
    with refused(RecipeError, "record more"):
        recipe_for(write_record(tmp_path / "a.csv", 2))


def test_short_record_gets_a_window_that_leaves_more_of_the_past(tmp_path: Path) -> None:
    path = write_record(tmp_path / "a.csv", 1000)
    proposal = propose_record(RecordOptions((str(path),), {"force": None}))
    assert parse_open_recipe(proposal.text, "proposed").guess.window.remaining_amplitude == 0.01
    assert any("leaves 1 % of what happened before it" in r for r in proposal.remarks)


def test_output_that_is_an_integral_is_refused_with_the_advice_to_learn_its_rate(
    tmp_path: Path,
) -> None:
    force, travel = force_and_travel(4000)
    columns = {"time": STEP * np.arange(4000), "force": force, "way": np.cumsum(travel)}
    with refused(RecipeError, "output instead"):
        recipe_for(write_columns(tmp_path / "a.csv", **columns))


def repeated(folder: Path, waves: int, period: int) -> RecordOptions:
    """Return options for a record of 24 000 samples, in which each wave comes several times."""
    rng, times = np.random.default_rng(0), 24_000 // period // waves
    force = np.concatenate([np.tile(rng.normal(size=period), times) for _ in range(waves)])
    columns = {
        "time": STEP * np.arange(len(force)),
        "force": force,
        "travel": lfilter([1], [1, -0.9], force),
    }
    return RecordOptions((str(write_columns(folder / "a.csv", **columns)),), {"force": None})


@pytest.mark.parametrize(
    ("waves", "period", "meaning"),
    [
        (1, 250, "the error says nothing about other inputs"),
        (1, 4000, "each part has inputs of its own"),
        (4, 1000, "each part has inputs of its own"),
    ],
)
def test_inputs_that_come_again_are_remarked_and_leave_no_estimator(
    tmp_path: Path, waves: int, period: int, meaning: str
) -> None:
    proposal = propose_record(repeated(tmp_path, waves, period))
    recipe = parse_open_recipe(proposal.text, "proposed").guess
    assert (recipe.data.by, recipe.estimator) == ("block", None)
    assert "are in one part" in proposal.draft.by_origin
    [remark] = [remark for remark in proposal.remarks if "come again" in remark]
    assert f"mostly {STEP * period:g} s ({period} samples) later" in remark
    assert meaning in remark


@pytest.mark.parametrize("drives", [(0, 0), (0, 0, 1, 2), (0,) * 10])
def test_records_of_one_drive_signal_are_remarked_by_their_names(
    tmp_path: Path, drives: tuple[int, ...]
) -> None:
    rng = np.random.default_rng(0)
    signals = rng.normal(size=(3, 1500))
    paths = []
    for number, drive in enumerate(drives):
        travel = lfilter([1], [1, -0.9], signals[drive]) + 0.01 * rng.normal(size=1500)
        columns = {"time": STEP * np.arange(1500), "force": signals[drive], "travel": travel}
        paths.append(str(write_columns(tmp_path / f"{number}.csv", **columns)))
    proposal = propose_record(RecordOptions(tuple(paths), {"force": None}))
    assert parse_open_recipe(proposal.text, "proposed").guess.data.by == "block"
    [remark] = [remark for remark in proposal.remarks if "come again" in remark]
    alike = [f"{number}.csv" for number, drive in enumerate(drives) if drive == 0]
    assert f"{', '.join(alike)} have them in common" in remark


def test_many_records_are_divided_as_whole_ones(tmp_path: Path) -> None:
    paths = tuple(str(write_record(tmp_path / f"{n}.csv", 400, seed=n)) for n in range(12))
    proposal = propose_record(RecordOptions(paths, {"force": None}, folder=tmp_path))
    recipe = parse_open_recipe(proposal.text, "proposed").guess
    assert (recipe.data.by, len(recipe.system.further)) == ("record", 11)
    assert recipe.system.model == "0.csv"


def test_unit_that_fmi_does_not_know_is_remarked_and_left_out(tmp_path: Path) -> None:
    path = write_record(tmp_path / "a.csv", header="time [s],force [pond],travel [m]")
    proposal = propose_record(RecordOptions((str(path),), {"force": None}))
    assert parse_open_recipe(proposal.text, "proposed").guess.system.inputs["force"].unit == "1"
    assert any("'pond', which FMI does not know" in remark for remark in proposal.remarks)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "expected which of them are inputs"),
        (["--input", "speed"], "no columns ['speed']; it has"),
        (["--input", "forc"], "did you mean 'force'?; --input COLUMN in place of --input forc"),
        (["--input", "force", "--output", "speed"], "no columns ['speed']; it has"),
        (["--input", "force", "--output", "force"], "is an output too"),
        (["--input", "force", "--name", "1st"], "--name '1st'; expected a letter"),
        (["--input", "force", "--time", "clock"], "clock"),
    ],
)
def test_wish_that_does_not_fit_the_columns_is_refused_in_one_line(
    tmp_path: Path, arguments: list[str], message: str
) -> None:
    path = write_record(tmp_path / "a.csv")
    result = invoke("init", path, "-o", tmp_path / "a.toml", *arguments)
    assert result.exit_code == 1
    assert message in " ".join(result.output.split())
    assert "Traceback" not in result.output
    assert not (tmp_path / "a.toml").exists()


def test_records_and_models_together_are_refused(tmp_path: Path) -> None:
    result = invoke("init", write_record(tmp_path / "a.csv"), "pump.fmu", "--input", "force")
    assert result.exit_code == 1
    assert "expected one model without --time" in " ".join(result.output.split())


@pytest.mark.parametrize(("option", "value"), [("--hold", "zero_order"), ("--fmu-step", "0.01")])
def test_option_of_a_model_is_refused_for_records(tmp_path: Path, option: str, value: str) -> None:
    record = tmp_path / "bench.csv"
    record.write_text("t,u,y\n0,0,0\n1,1,1\n", encoding="utf-8")
    place = str(tmp_path / "bench.toml")
    result = invoke("init", str(record), "-o", place, "--input", "u", option, value)
    assert result.exit_code != 0
    assert f"{option} {value} for records; expected none" in " ".join(result.output.split())


def test_init_and_try_lead_from_a_record_to_its_window(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_record(tmp_path / "bench.csv", 6000, noise=0.01)
    proposed = invoke("init", "bench.csv", "--input", "force", "-o", "bench.toml")
    assert proposed.exit_code == 0, proposed.output
    recipe = " ".join((tmp_path / "bench.toml").read_text(encoding="utf-8").split())
    assert "Half of the hidden units" in recipe
    assert "the shares of all samples for the training," in recipe
    tried = invoke("try", "bench.toml", "--json", "bench.json")
    assert tried.exit_code == 0, tried.output
    figures = json.loads((tmp_path / "bench.json").read_text())
    assert figures["window"]["sufficient"]
    assert figures["data"]["trajectories"]["train"] >= 1
    assert figures["data"]["wall_time_per_simulated_second_s"] is None
    assert "slowest pole" in tried.output
    assert "Effects of the initial state have" in tried.output


SAMPLES = 300


def columns(*names: str, seed: int = 0) -> dict[str, np.ndarray]:
    """Times and signals of these names, by which some may pass for times too."""
    rng = np.random.default_rng(seed)
    return {"time": 0.01 * np.arange(SAMPLES)} | {n: rng.normal(size=SAMPLES) for n in names}


def as_csv(path: Path, table: dict[str, np.ndarray]) -> str:
    values = np.stack(list(table.values()), axis=1)
    np.savetxt(path, values, "%.9g", ",", header=",".join(table), comments="")
    return str(path)


def options(*paths: str, inputs: tuple[str, ...] = ("F",), **more: Any) -> RecordOptions:
    return RecordOptions(paths, dict.fromkeys(inputs), **more)


@pytest.mark.parametrize(
    ("inputs", "outputs", "found"),
    [
        (("F",), ("T",), ("T",)),
        (("F",), ("x",), ("x",)),
        (("F",), (), ("x", "T")),
        (("T",), ("x",), ("x",)),
        (("T",), (), ("F", "x")),
    ],
)
@pytest.mark.parametrize("time", [None, "time"])
def test_torque_called_t_is_a_signal_and_no_clock(
    tmp_path: Path,
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    found: tuple[str, ...],
    time: str | None,
) -> None:
    path = as_csv(tmp_path / "a.csv", columns("F", "x", "T"))
    asked = options(path, inputs=inputs, outputs=outputs, time=time)
    (record,), _ = read_chosen(asked)
    assert chosen_columns(asked, record) == (inputs, found)
    assert (record.clock, record.other_clocks) == ("time", {})


def test_dates_are_the_clock_beside_a_torque_that_comes_first(tmp_path: Path) -> None:
    table = columns("T", "F", "x")
    dates = (1e9 * table.pop("time")).astype("datetime64[ns]")
    pq.write_table(pa.table({**table, "time": dates}), tmp_path / "a.parquet")
    (record,), _ = read_chosen(options(str(tmp_path / "a.parquet"), outputs=("x",)))
    assert (record.clock, list(record.columns)) == ("time", ["F", "x"])


def test_column_that_only_one_file_has_does_not_matter_where_outputs_are_named(
    tmp_path: Path,
) -> None:
    paths = (
        as_csv(tmp_path / "a.csv", columns("F", "x")),
        as_csv(tmp_path / "b.csv", columns("F", "x", "extra")),
    )
    records, _ = read_chosen(options(*paths, outputs=("x",)))
    assert [list(record.columns) for record in records] == [["F", "x"]] * 2
    with refused(RecordError, "extra", "columns that"):
        read_chosen(options(*paths))


def test_two_columns_of_a_wide_file_need_no_room_for_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = as_csv(tmp_path / "a.csv", columns("F", "x", *(f"c{n}" for n in range(50))))
    most = partial(read_records, most=3 * SAMPLES)
    monkeypatch.setattr("slide_fmu.records.keys.read_records", most)
    (record,), _ = read_chosen(options(path, outputs=("x",)))
    assert list(record.columns) == ["F", "x"]


def test_named_arrays_of_another_length_than_most_are_read(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, values in columns("F", "x", "y").items():
            file[f"a/{name}"] = values
        for name, values in columns("F", "x").items():
            file[f"b/{name}"] = values[::2]
    path = str(tmp_path / "a.h5")
    for outputs in (("b/x",), ()):
        asked = options(path, inputs=("b/F",), outputs=outputs, time="b/time")
        (record,), _ = read_chosen(asked)
        assert chosen_columns(asked, record) == (("b/F",), ("b/x",))
    with refused(RecordError, "lengths {'a/F': 300", "'b/x': 150}"):
        read_chosen(options(path, inputs=("a/F",), outputs=("b/x",)))


def test_times_do_not_count_beside_a_given_step_where_none_is_named(tmp_path: Path) -> None:
    table = columns("F", "x")
    table["time"] = np.round(table["time"], 1)  # they repeat
    path = as_csv(tmp_path / "a.csv", table)
    (record,), _ = read_chosen(options(path, step=0.01))
    [message] = [f.message for f in examine((record,)) if f.severity == "refused"]
    assert "--time none --step SECONDS" in message
    (record,), parameters = read_chosen(options(path, step=0.01, time="none"))
    assert record.time == pytest.approx(0.01 * np.arange(SAMPLES))
    assert list(record.columns) == ["F", "x"]
    assert parameters == {"sample_step": 0.01}
    with refused(RecipeError, "--time none without --step"):
        read_chosen(options(path, time="none"))


def test_many_records_of_several_periods_each_are_whole_too(tmp_path: Path) -> None:
    """Inputs that come again in one record alone leave each part inputs of its own."""
    paths = []
    for number in range(12):
        rng = np.random.default_rng(number)
        force = np.tile(rng.normal(size=500), 2)
        travel = lfilter([1], [1, -0.9], force) + 0.01 * rng.normal(size=1000)
        columns = {"time": STEP * np.arange(1000), "force": force, "travel": travel}
        paths.append(str(write_columns(tmp_path / f"{number}.csv", **columns)))
    proposal = propose_record(RecordOptions(tuple(paths), {"force": None}))
    assert parse_open_recipe(proposal.text, "proposed").guess.data.by == "record"
    [remark] = [remark for remark in proposal.remarks if "come again" in remark]
    assert "each part has inputs of its own" in remark
