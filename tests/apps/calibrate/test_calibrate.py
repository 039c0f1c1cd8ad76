"""Parameters of known surrogates are found again, with intervals that hold them."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slide_fmu
from slide_fmu.apps.calibrate.calibrate import calibrate
from slide_fmu.apps.calibrate.result import Calibration
from slide_fmu.fmu.export import export_fmu
from slide_fmu.surrogate.surrogate import Surrogate
from tests.apps.calibrate.records import TRUE, measured, surrogate_with
from tests.figures import run_figures
from tests.fmu.samples import Shape, random_surrogate
from tests.refusals import refused

ONE = {"mass": TRUE["mass"]}
EXACT = 1e-4
"""What rounding of float32 does to a value that is found without noise."""


def holds(found: Calibration, true: dict[str, float]) -> list[bool]:
    """Whether each interval holds the true value."""
    return [p.low <= true[p.parameter.name] <= p.high for p in found.parameters]


def test_parameters_of_a_clean_record_are_found_exactly() -> None:
    surrogate = surrogate_with(2)
    found = calibrate(surrogate, *measured(surrogate, TRUE))
    assert found.values == pytest.approx(TRUE, abs=EXACT)
    assert found.outputs[0].after < 1e-3 * found.outputs[0].before
    assert found.samples == 600 - surrogate.window.n_truncated


def test_same_record_and_seed_give_the_same_numbers() -> None:
    surrogate = surrogate_with(2)
    record = measured(surrogate, TRUE, noise=0.05)
    assert calibrate(surrogate, *record, seed=3) == calibrate(surrogate, *record, seed=3)


@pytest.mark.extended
@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_intervals_hold_the_true_value_as_often_as_they_say(colour: float) -> None:
    """Of 40, 95 % are 38; fewer than 34 would be chance once in a hundred times."""
    surrogate = surrogate_with(1)
    records = [
        measured(surrogate, ONE, seed, samples=500, noise=0.05, colour=colour)
        for seed in range(40)
    ]
    found = [calibrate(surrogate, *record) for record in records]
    assert sum(holds(c, ONE)[0] for c in found) >= 34
    off = [abs(c.values["mass"] - ONE["mass"]) for c in found]
    half = np.mean([0.5 * (c.parameters[0].high - c.parameters[0].low) for c in found])
    assert 1.2 * np.sqrt(np.mean(np.square(off))) < half < 4 * np.sqrt(np.mean(np.square(off)))


def test_own_error_of_the_surrogate_widens_the_interval() -> None:
    surrogate = surrogate_with(1)
    record = measured(surrogate, ONE, noise=0.01)

    def width(own_error: list[float] | None) -> float:
        (fitted,) = calibrate(surrogate, *record, own_error=own_error).parameters
        return fitted.high - fitted.low

    assert width([0.0]) == width(None)
    assert width([0.02]) > 3 * width(None)


def test_unknown_own_error_is_remarked() -> None:
    surrogate = surrogate_with(1)
    record = measured(surrogate, ONE, noise=0.01)
    assert any("own error is not known" in text for text in calibrate(surrogate, *record).remarks)
    assert calibrate(surrogate, *record, own_error=[0.001]).remarks == ()


def test_beginning_of_a_record_does_not_count() -> None:
    """Another past than the surrogate assumes would be seen there."""
    surrogate = surrogate_with(2)
    inputs, outputs = measured(surrogate, TRUE)
    lead = surrogate.window.n_truncated
    found = calibrate(surrogate, inputs[lead:], outputs[lead:])
    assert found.values == pytest.approx(TRUE, abs=1e-2)
    spoilt = outputs.copy()
    spoilt[:lead] += 100.0
    assert calibrate(surrogate, inputs, spoilt) == calibrate(surrogate, inputs, outputs)


def test_several_records_count_as_one_set_of_data() -> None:
    surrogate = surrogate_with(2)
    records = [
        measured(surrogate, TRUE, seed, samples, noise=0.02)
        for seed, samples in ((1, 300), (2, 500))
    ]
    inputs, outputs = zip(*records, strict=True)
    found = calibrate(surrogate, list(inputs), list(outputs))
    assert found.samples == 800 - 2 * surrogate.window.n_truncated
    alone = calibrate(surrogate, *records[0])
    for both, one in zip(found.parameters, alone.parameters, strict=True):
        assert both.high - both.low < one.high - one.low


def test_outputs_count_by_their_noise() -> None:
    surrogate = surrogate_with(1, n_outputs=2)
    inputs, clean = measured(surrogate, ONE)
    noise = np.random.default_rng(5).normal(size=len(clean))
    spoilt = clean + np.stack([0 * noise, noise], axis=1)
    found = calibrate(surrogate, inputs, spoilt)
    assert found.values == pytest.approx(ONE, abs=1e-3)
    assert found.outputs[1].after == pytest.approx(1.0, rel=0.1)


def test_output_that_nobody_measured_does_not_count() -> None:
    surrogate = surrogate_with(1, n_outputs=2)
    inputs, outputs = measured(surrogate, ONE)
    outputs[:, 0] = np.nan
    outputs[100:150, 1] = np.nan
    found = calibrate(surrogate, inputs, outputs)
    assert found.values == pytest.approx(ONE, abs=EXACT)
    assert [fit.name for fit in found.outputs] == ["y1"]


def test_fixed_parameter_keeps_its_value() -> None:
    surrogate = surrogate_with(2)
    record = measured(surrogate, TRUE)
    found = calibrate(surrogate, *record, fixed={"damping": TRUE["damping"]})
    assert found.values == pytest.approx(TRUE, abs=EXACT)
    assert [p.parameter.name for p in found.parameters] == ["mass"]
    other = calibrate(surrogate, *record, fixed={"damping": 1.0})
    assert other.outputs[0].after > 10 * found.outputs[0].after


def test_value_outside_the_range_ends_at_the_bound_and_says_so() -> None:
    surrogate = surrogate_with(1)
    inputs, outputs = measured(surrogate, {"mass": 3.0})
    nearer = surrogate.predict_newest(inputs, {"mass": 2.8})
    found = calibrate(surrogate, inputs, outputs + (outputs - nearer))
    (fitted,) = found.parameters
    assert fitted.value == pytest.approx(3.0, abs=1e-3)
    assert fitted.at_end
    assert "mass lies at the end of its range, 3 kg" in found.remarks[0]


def with_terms(surrogate: Surrogate, *numbers: int | None) -> Surrogate:
    """A surrogate each of whose terms is that of another number of it, or nothing."""
    network: Any = surrogate.network
    old = network.polynomial.terms
    nothing = dataclasses.replace(old[0], **{k: 0 * v for k, v in old[0].arrays().items()})
    terms = tuple(nothing if number is None else old[number] for number in numbers)
    polynomial = dataclasses.replace(network.polynomial, terms=terms)
    moved = type(network)(polynomial, network.n_samples, network.n_out, network.features)
    return dataclasses.replace(surrogate, network=moved)


def test_terms_of_two_parameters_have_the_degrees_that_the_tests_below_mean() -> None:
    network: Any = surrogate_with(2).network
    degrees = ((0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (2, 0))
    assert network.polynomial.basis.degrees == degrees


def test_parameters_of_one_effect_are_said_to_be_alike() -> None:
    surrogate = with_terms(surrogate_with(2), 0, 2, 2, None, None, None)
    found = calibrate(surrogate, *measured(surrogate, TRUE, noise=0.01))
    assert found.correlation[0][1] == pytest.approx(-1, abs=1e-3)
    assert any("mass and damping can hardly be distinguished" in text for text in found.remarks)


def test_parameter_that_changes_nothing_is_said_to_be_undetermined() -> None:
    surrogate = with_terms(surrogate_with(2), 0, None, 2, None, None, 5)
    found = calibrate(surrogate, *measured(surrogate, TRUE, noise=0.01))
    mass, damping = found.parameters
    assert (damping.low, damping.high) == (-2.0, 2.0)
    assert "damping is not determined by the record" in found.remarks[0]
    assert mass.low <= TRUE["mass"] <= mass.high
    assert mass.remark is None


def test_fmu_tells_the_error_that_was_measured(tmp_path: Path) -> None:
    surrogate = surrogate_with(1)
    record = measured(surrogate, ONE, noise=0.01)
    outputs = [{"name": "y0", "relative_rmse": 0.02}]
    provenance = {"measured": run_figures(validation={"in range": {"outputs": outputs}}).dump()}
    fmu = export_fmu(surrogate, tmp_path / "a.fmu", provenance=provenance)
    told = calibrate(surrogate, *record, own_error=[0.02])
    assert slide_fmu.calibrate(fmu, *record) == told
    bare = export_fmu(surrogate, tmp_path / "b.fmu", provenance={"measured": {"validation": 1}})
    assert slide_fmu.calibrate(bare, *record) == calibrate(surrogate, *record)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"fixed": TRUE}, "expected one that is fitted"),
        ({"fixed": {"weight": 1.0}}, "'weight'; expected one of"),
        ({"fixed": {"mass": 4.0}}, "in its range, 1 .. 3 kg"),
        ({"own_error": [0.1, 0.1]}, "own_error = [0.1, 0.1]; expected 1 numbers"),
        ({"own_error": [-0.1]}, "own_error = [-0.1]; expected 1 numbers"),
    ],
)
def test_wrong_arguments_are_refused_in_words(given: dict[str, Any], message: str) -> None:
    surrogate = surrogate_with(2)
    with pytest.raises(ValueError, match=re.escape(message)):
        calibrate(surrogate, *measured(surrogate, TRUE, samples=100), **given)


def test_records_that_do_not_fit_are_refused_in_words() -> None:
    surrogate = surrogate_with(2)
    inputs, outputs = measured(surrogate, TRUE, samples=100)
    cases: list[tuple[Any, Any, str]] = [
        (inputs, outputs[1:], "expected (100, 1)"),
        (inputs, np.full_like(outputs, np.inf), "a value is infinite"),
        (inputs, np.full_like(outputs, np.nan), "0 samples remain"),
        ([inputs], [outputs, outputs], "1 records of inputs and 2"),
        (inputs[:50], outputs[:50], "36 samples remain"),
        (inputs[:10], outputs[:10], "record at least 0.27 s without a break"),
    ]
    for driven, answers, message in cases:
        with pytest.raises(ValueError, match=re.escape(message)):
            calibrate(surrogate, driven, answers)


def test_surrogate_without_parameters_is_refused() -> None:
    surrogate = random_surrogate(Shape())
    with refused(ValueError, "has no physical parameters"):
        calibrate(surrogate, np.zeros((100, 1)), np.zeros((100, 1)))
