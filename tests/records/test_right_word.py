"""What is wrong in a file is named before anything is concluded about the machine."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from slide_fmu.cli.app import app
from slide_fmu.propose.proposal import RefusedProposalError
from slide_fmu.records.faults import dropouts, held_samples, missing_codes, own_rate
from slide_fmu.records.proposal import RecordOptions, propose_record
from slide_fmu.systems.declared import Parameter
from tests.records.bench import (
    SAMPLES,
    STEP,
    late,
    response,
    smooth,
    times,
    write,
    write_bench,
)
from tests.records.samples import clean_signals
from tests.refusals import refused

RNG = np.random.default_rng(3)
WRONG = ("an integral", "an oscillation that does not decay", "free direction")


def init(path: Path, step: float | None = None, **read: Parameter) -> tuple[str, ...]:
    """Propose a recipe, and return its remarks."""
    inputs = {"valve": None}
    return propose_record(RecordOptions((str(path),), inputs, step=step, read=read)).remarks


def refusal(path: Path, **read: Parameter) -> RefusedProposalError:
    with pytest.raises(RefusedProposalError) as caught:
        init(path, **read)
    assert not any(word in str(caught.value) for word in WRONG)
    assert tomllib.loads(caught.value.text)["system"]["kind"] == "record"
    return caught.value


def said(remarks: tuple[str, ...], *words: str) -> bool:
    return any(all(word in remark for word in words) for remark in remarks)


@pytest.fixture(scope="module")
def valve() -> np.ndarray:
    return smooth()


@pytest.fixture(scope="module")
def level(valve: np.ndarray) -> np.ndarray:
    return response(valve)


def test_lost_rows_are_named_first_and_filled_if_wished(
    tmp_path: Path, valve: np.ndarray, level: np.ndarray
) -> None:
    path = write_bench(tmp_path / "a.csv", valve, level, RNG.random(SAMPLES) > 0.02)
    error = refusal(path, fill=0)
    first, last = str(error).splitlines()
    assert "gaps" in first
    assert "samples of 0.01 s are missing" in first
    assert "--read fill=N" in first
    assert last.startswith("with the files as they are: ")
    assert "a memory that is longer than the pieces" in last
    assert "# parameters = { fill = 1 }" in error.text
    assert said(init(path, fill=3), "lost samples", "are filled")


@pytest.mark.parametrize("code", [-9999.0, 999.9, 32767.0, -1e30])
def test_codes_for_missing_values_are_refused_with_the_key(
    tmp_path: Path, valve: np.ndarray, level: np.ndarray, code: float
) -> None:
    spoilt = level.copy()
    spoilt[RNG.random(SAMPLES) < 0.01] = code
    spoilt[500:520] = code
    error = refusal(write_bench(tmp_path / "a.csv", valve, spoilt))
    assert f"are exactly {code:.10g}" in str(error)
    assert f"--read missing={code:.10g}" in str(error)
    assert f"# parameters = {{ missing = {code!r}, fill = 1 }}" in error.text
    assert tomllib.loads(error.text)["system"]["outputs"]["level"]["range"][1] < 50
    assert said(init(tmp_path / "a.csv", missing=code, fill=1), "values are empty")


def test_numbers_that_come_from_the_machine_are_no_codes() -> None:
    for seed in range(4):
        for values in clean_signals(seed).values():
            assert missing_codes(values) == []
    assert missing_codes(np.array([0.0, 500.0, 999.0] * 50)) == []
    assert missing_codes(np.linspace(0, 9999, 500)) == []


def test_number_that_is_far_from_all_others_is_remarked(
    tmp_path: Path, valve: np.ndarray, level: np.ndarray
) -> None:
    spoilt = 100 + level
    spoilt[[100, 101, 102, 900, 901, 1700]] = 0.0
    remarks = init(write_bench(tmp_path / "a.csv", valve, spoilt))
    assert said(remarks, "6 samples in 3 runs are exactly 0", "--read missing=0")
    assert not said(remarks, "values are empty")


@pytest.mark.parametrize("noise", [0.0, 0.1])
@pytest.mark.parametrize("digits", [9, 2])
def test_number_amid_all_others_to_which_a_signal_drops_is_remarked(
    valve: np.ndarray, noise: float, digits: int
) -> None:
    for value in (0.0, 0.5):
        spoilt = np.round(response(valve, noise=noise), digits)
        lost = RNG.choice(np.arange(5, SAMPLES - 5, 3), 40, replace=False)
        spoilt[lost] = value
        [code] = dropouts(spoilt)
        assert code.value == value
        assert 20 < code.samples <= 40
        assert set(np.flatnonzero(spoilt == value)) >= {code.first}
        assert code.off > 3 * code.usual_off


def test_dropouts_are_remarked_with_the_key(
    tmp_path: Path, valve: np.ndarray, level: np.ndarray
) -> None:
    spoilt = level.copy()
    spoilt[7:-7:90] = 0.0
    path = write_bench(tmp_path / "a.csv", valve, spoilt)
    assert said(init(path), "are exactly 0", "jump there by", "--read missing=0")
    assert not said(init(path, missing=0, fill=1), "are exactly 0")
    resting = np.where(np.arange(SAMPLES) % 1000 < 300, 0.0, valve)
    remarks = init(write_bench(path, resting, spoilt))
    assert said(remarks, "jump there by", "leave these empty in the file")
    assert not said(remarks, "--read missing=0")


def test_signals_that_move_as_machines_do_drop_to_no_number() -> None:
    rng = np.random.default_rng(0)
    for seed in range(4):
        for values in clean_signals(seed).values():
            assert dropouts(values) == []
    held = np.repeat(rng.normal(size=200), 5)
    pulses = np.where(rng.random(2000) < 0.02, 1.0, 0.0)
    for values in (held, pulses + rng.normal(scale=1e-3, size=2000), rng.normal(size=2000)):
        assert dropouts(values) == []


def test_held_sensor_is_named_with_the_step_that_suits_it(
    tmp_path: Path, valve: np.ndarray, level: np.ndarray
) -> None:
    held = np.repeat(level[::10], 10)
    error = refusal(write_bench(tmp_path / "a.csv", valve, held))
    assert "it changes every 10 samples only" in str(error).splitlines()[0]
    assert "--step 0.1 --read fill=9" in str(error)
    assert "# step = 0.1" in error.text
    assert not said(init(tmp_path / "a.csv", step=0.1, fill=9), "it changes every")


def test_output_of_a_lower_rate_than_the_inputs_is_named(
    tmp_path: Path, valve: np.ndarray, level: np.ndarray
) -> None:
    sparse = np.where(np.arange(SAMPLES) % 5 == 0, level, np.nan)
    error = refusal(write_bench(tmp_path / "a.csv", valve, sparse))
    assert "'level': it has a value every 0.05 s (20 Hz) only, and 'valve' every" in str(error)
    assert "every 0.01 s (100 Hz): the file has two rates" in str(error)
    assert not said(init(tmp_path / "a.csv", step=0.05, fill=4), "empty")


@pytest.mark.parametrize(
    ("step", "offset", "named", "words", "fill"),
    [
        (0.1, 0.003, "level", "every 0.1 s (10 Hz) only, and 'valve' every 0.01 s", 10),
        (0.1, 0.0, "valve", "every 0.1 s (10 Hz) only, and 'level' every 0.01 s", 9),
        (0.015, 0.004, "level", "every 0.015 s (66.7 Hz) only, and 'valve' every", 2),
        (0.01, 0.005, "valve", "it has no value in 50 % of the rows, those of 'level'", 1),
    ],
)
def test_two_rates_in_a_file_are_named_with_both(
    tmp_path: Path, step: float, offset: float, named: str, words: str, fill: int
) -> None:
    """Rows of two loggers that are sorted by time; each leaves the other's column empty."""
    even = times().round(9)
    own = np.arange(offset, even[-1], step).round(9)
    time, columns = np.union1d(even, own), {"valve": smooth(), "level": response(smooth())}
    for name, values in columns.items():
        mine = np.isin(time, own if name == named else even)
        columns[name] = np.where(mine, np.interp(time, even, values), np.nan)
    path = write(tmp_path / "a.csv", **{"time [s]": time}, **columns)
    whole = str(refusal(path))
    assert len(set(re.findall(r"--step \S+ --read fill=\d+", whole))) == 1
    [message] = [line for line in whole.splitlines() if f"column {named!r}" in line]
    assert words in message
    assert f"--step {step:g} --read fill={fill}" in message
    assert not said(init(path, step=step, fill=fill), f"column {named!r}: it has")


def test_values_that_are_lost_at_random_have_no_rate_of_their_own() -> None:
    time, rng = STEP * np.arange(SAMPLES), np.random.default_rng(0)
    level = response(smooth())
    for part in (0.3, 0.5, 0.9):
        assert own_rate(time, np.where(rng.random(SAMPLES) < part, np.nan, level)) is None
    assert own_rate(time, np.where(np.arange(SAMPLES) > SAMPLES / 2, np.nan, level)) is None
    kept = (np.arange(SAMPLES) % 3 == 0) & (rng.random(SAMPLES) > 0.05)
    every_third = np.where(kept, level, np.nan)
    found = own_rate(time, every_third)
    assert found is not None
    assert found.step == pytest.approx(3 * STEP, rel=1e-6)


def test_held_values_are_found_by_their_rate_and_coarse_ones_are_not() -> None:
    level = response(smooth())
    found = held_samples(np.repeat(level[::33], 33)[:SAMPLES])
    assert found is not None
    assert (found.period, found.longest) == (33.0, 32)
    uneven = level[np.searchsorted(np.arange(0, SAMPLES, 100 / 30), np.arange(SAMPLES)) * 3 % 3999]
    found = held_samples(uneven)
    assert found is not None
    assert found.period == pytest.approx(100 / 30, rel=0.01)
    ramp = np.round(np.abs(np.arange(SAMPLES) % 1000 - 500.0) / 10)
    for values in (level, np.round(level, 1), ramp, RNG.integers(0, 2, SAMPLES) * 1.0):
        assert held_samples(values) is None


def test_white_noise_is_no_response(tmp_path: Path, valve: np.ndarray) -> None:
    error = refusal(write_bench(tmp_path / "a.csv", valve, RNG.normal(size=SAMPLES)))
    assert "'level': it is white noise" in str(error)


def test_static_set_points_are_named(tmp_path: Path) -> None:
    points = np.zeros(SAMPLES)
    points[500:] = 1.0
    remarks = init(write_bench(tmp_path / "a.csv", points, response(points)))
    assert said(remarks, "the inputs ['valve'] change at 1 of 4000 samples")


@pytest.mark.parametrize("gain_alone", [True, False])
def test_dead_time_is_no_lack_of_an_answer(tmp_path: Path, gain_alone: bool) -> None:
    noise = RNG.normal(size=SAMPLES)
    answer = late(noise, 20)
    level = answer + 1e-2 * RNG.normal(size=SAMPLES) if gain_alone else response(answer)
    remarks = init(write_bench(tmp_path / "a.csv", noise, level))
    assert said(remarks, "it answers the inputs after about 2")
    assert not said(remarks, "no input moves it")


def test_oscillation_that_outlasts_the_record_decays_nevertheless(
    tmp_path: Path, valve: np.ndarray
) -> None:
    path = write_bench(tmp_path / "a.csv", valve[:1500], response(valve, 0.01, 1e-4)[:1500])
    error = refusal(path)
    assert "a memory that is longer than the pieces of the records" in str(error)
    assert "1049 samples, 10.49 s. It falls to 5 % within 29." in str(error)


def test_longest_window_that_fits_is_proposed_with_its_price(
    tmp_path: Path, valve: np.ndarray
) -> None:
    path = write_bench(tmp_path / "a.csv", valve, response(valve, 0.05))
    proposal = propose_record(RecordOptions((str(path),), {"valve": None}))
    assert tomllib.loads(proposal.text)["window"]["remaining_amplitude"] == 0.1
    assert said(proposal.remarks, "longest window that fits", "truncation error of up to 10 %")
    error = refusal(write_bench(tmp_path / "b.csv", valve[:2000], response(valve, 0.04)[:2000]))
    assert "# remaining_amplitude = 0.5" in error.text


def test_clock_without_a_rate_is_remarked(
    tmp_path: Path, valve: np.ndarray, level: np.ndarray
) -> None:
    time = np.cumsum(STEP * RNG.uniform(0.2, 3.0, SAMPLES))
    columns = {"time": time, "valve": valve, "level": level}
    remarks = init(write(tmp_path / "a.csv", **columns))
    assert said(remarks, "the clock is uneven", "the median is")
    assert not said(remarks, "cut into")


def test_refused_init_writes_its_recipe_and_exits_with_an_error(
    tmp_path: Path, valve: np.ndarray, level: np.ndarray
) -> None:
    spoilt = level.copy()
    spoilt[::50] = -9999
    path, recipe = write_bench(tmp_path / "a.csv", valve, spoilt), tmp_path / "a.toml"
    names = ["init", str(path), "--input", "valve", "-o", str(recipe)]
    result = CliRunner().invoke(app, names)
    assert result.exit_code == 1
    assert "says in comments what to change" in " ".join(result.output.split())
    text = recipe.read_text()
    assert text.startswith("# slide-fmu init refused these records as they are.")
    mending = ["--read", "missing=-9999", "--read", "fill=1"]
    mended = CliRunner().invoke(app, [*names, "--force", *mending])
    assert mended.exit_code == 0, mended.output
    keys = tomllib.loads(recipe.read_text())["system"]["parameters"]
    assert keys == {"missing": -9999, "fill": 1}


def test_many_files_have_one_remark_of_each_kind(tmp_path: Path) -> None:
    """Each of them has lost rows, an outlier, and times without a unit that jitter."""
    rng = np.random.default_rng(0)
    paths = []
    for seed in range(12):
        valve = smooth(1200, seed)
        level = response(valve, 0.4)
        level[600] += 60.0
        time = times(1200) + 0.03 * STEP * rng.normal(size=1200)
        kept = np.delete(np.arange(1200), [200, 300 + seed])
        columns = {"time": time[kept], "valve": valve[kept], "level": level[kept]}
        paths.append(str(write(tmp_path / f"{seed}.csv", **columns)))
    remarks = propose_record(RecordOptions(tuple(paths), {"valve": None})).remarks
    for words in (
        "gaps",
        "jump away",
        "off even ones",
        "have no unit",
        "resampled from",
        "cut into",
    ):
        assert sum(words in remark for remark in remarks) == 1, words
    assert said(remarks, "gaps", "The same is so in", "and 9 more files")
    assert said(remarks, "and 10 more files: cut into 36 pieces")


def test_log_of_a_robot_is_read_as_it_is(
    tmp_path: Path, valve: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its names have numbers in brackets, and its times are ms since 1970."""
    monkeypatch.chdir(tmp_path)
    other = smooth(seed=5)
    columns = {"q[0]": valve, "q[1]": other, "tau[0]": response(valve), "tau[1]": response(other)}
    counts = (1710032340000 + 1000 * times()).round().astype(np.int64)
    rows = zip(counts, *columns.values(), strict=True)
    lines = [",".join([str(count), *(f"{one:.6g}" for one in values)]) for count, *values in rows]
    Path("robot.csv").write_text("\n".join([",".join(["timestamp", *columns]), *lines]))
    inputs = ["--input", "q[0]", "--input", "q[1]"]
    proposed = CliRunner().invoke(app, ["init", "robot.csv", *inputs])
    assert proposed.exit_code == 0, proposed.output
    recipe = tomllib.loads(Path("robot.toml").read_text())
    assert list(recipe["system"]["inputs"]) == ["q[0]", "q[1]"]
    assert recipe["window"]["step"] == STEP
    tried = CliRunner().invoke(app, ["try", "robot.toml"])
    assert tried.exit_code == 0, tried.output


@pytest.mark.parametrize(
    ("read", "words"),
    [
        ("missing", "expected KEY=VALUE"),
        ("time_unit=weeks", "time_unit = 'weeks'; expected one of ['s',"),
        ("separator=;;", "separator = ';;'; expected one sign"),
        ("decimal=x", "decimal = 'x'; expected '.' or ','"),
        ("header=first", "header = 'first'; expected the line of the names"),
        ("missing=none", "missing = 'none'; expected a number that stands"),
        ("fill=-1", "fill = -1; expected the most missing samples"),
        ("filled=1", "unknown parameters ['filled']"),
    ],
)
def test_wrong_key_is_refused_with_what_is_expected(
    tmp_path: Path, valve: np.ndarray, level: np.ndarray, read: str, words: str
) -> None:
    path = write_bench(tmp_path / "a.csv", valve[:500], level[:500])
    result = CliRunner().invoke(app, ["init", str(path), "--input", "valve", "--read", read])
    assert result.exit_code == 1
    assert words in " ".join(result.output.split())


def test_broken_times_and_constant_columns_still_give_a_recipe(
    tmp_path: Path, valve: np.ndarray
) -> None:
    columns = {"time": np.zeros(SAMPLES), "valve": valve, "level": np.ones(SAMPLES)}
    error = refusal(write(tmp_path / "a.csv", **columns))
    assert "the time never rises" in str(error)
    assert "'level': the value is 1 in all samples" in str(error)


def test_filled_samples_lie_where_the_lost_ones_were(
    tmp_path: Path, valve: np.ndarray, level: np.ndarray
) -> None:
    from slide_fmu.records.filling import filled
    from slide_fmu.records.keys import RecordKeys

    path = write_bench(tmp_path / "a.csv", valve, level, RNG.random(SAMPLES) > 0.02)
    (record,) = RecordKeys(fill=3).read([str(path)], ("valve", "level"))
    whole = filled(record, ("valve",), ("level",), "first_order")
    assert whole.time == pytest.approx(times(), abs=1e-6)
    assert np.abs(whole.columns["level"] - level).max() < 0.02 * level.std()
    held = filled(record, ("valve",), ("level",), "zero_order")
    lost = ~np.isin(np.round(whole.time, 4), np.round(record.time, 4))
    before = np.flatnonzero(lost & ~np.roll(lost, 1))
    assert np.array_equal(held.columns["valve"][before], held.columns["valve"][before - 1])
    with refused(ValueError, "fill"):
        RecordKeys.of({"fill": True}, "a.csv")


def frozen(values: np.ndarray, begin: int = 1500, count: int = 400) -> np.ndarray:
    """Values of a sensor that stands still for a while."""
    still = values.copy()
    still[begin : begin + count] = values[begin]
    return still


@pytest.mark.parametrize("which", ["valve", "level"])
def test_sensor_that_stands_still_is_refused_with_the_key_that_leaves_it_out(
    tmp_path: Path, valve: np.ndarray, level: np.ndarray, which: str
) -> None:
    columns = {"valve": valve, "level": level}
    columns[which] = frozen(columns[which])
    path = write(tmp_path / "still.csv", **{"time [s]": times()}, **columns)
    error = refusal(path)
    assert f"column '{which}': it is exactly" in str(error)
    assert "400 samples in a row from sample 1501 (line 1502, t = 15 s)" in str(error)
    assert "its sensor stands still" in str(error)
    assert "# parameters = { stuck = 20 }" in error.text
    assert said(init(path, stuck=20), "400 of 4000 values are empty")
    assert not said(init(path, stuck=0), "stands still")


def test_input_that_rests_while_the_machine_comes_to_rest_is_no_fault(
    tmp_path: Path, valve: np.ndarray
) -> None:
    resting = valve.copy()
    resting[1500:2500] = 0.0
    path = write_bench(tmp_path / "rest.csv", resting, response(resting))
    assert not said(init(path), "stands still")


def test_one_of_two_inputs_that_rests_is_remarked(tmp_path: Path, valve: np.ndarray) -> None:
    other = smooth(seed=5)
    still = frozen(other)
    path = write(
        tmp_path / "two.csv",
        **{"time [s]": times(), "valve": valve, "other": still, "level": response(valve + still)},
    )
    options = RecordOptions((str(path),), {"valve": None, "other": None})
    assert said(propose_record(options).remarks, "'other'", "its sensor stands still")


def test_rows_that_are_lost_singly_are_filled_by_a_key_of_the_recipe(
    tmp_path: Path, valve: np.ndarray, level: np.ndarray
) -> None:
    kept = np.random.default_rng(4).random(SAMPLES) > 0.02
    path = write_bench(tmp_path / "lost.csv", valve, level, kept)
    options = RecordOptions((str(path),), {"valve": None})
    proposal = propose_record(options)
    assert tomllib.loads(proposal.text)["system"]["parameters"]["fill"] in (1, 2)
    assert said(proposal.remarks, "samples are lost singly", "fill = ")
    assert "the record is cut there into pieces" in str(refusal(path, fill=0))
