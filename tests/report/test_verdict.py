"""A verdict says in a few lines what a user must know of an FMU."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from slide_fmu.report.verdict import Subject, verdict
from slide_fmu.report.verdict_facts import verdict_of
from tests.figures import run_figures

SUBJECT = Subject((("force", -100.0, 100.0, "N"), ("ratio", 0.0, 1.0, "1")), 15.0, 18.5, 0.02)


def in_range(**more: Any) -> dict[str, Any]:
    outputs = [{"name": "a", "relative_rmse": 0.002}, {"name": "b", "relative_rmse": 0.004}]
    return {"amplitude": [1.0, 1.0], "outputs": outputs, **more}


PLAIN = {
    "hold": "first_order",
    "late_s": None,
    "smooth_hz": [0.1, 1.0],
    "outputs": [
        {"rough": 0.03, "smooth": 0.014, "known_to_step_end": 0.003, "smooth_if_held": None},
        {"rough": 0.02, "smooth": 0.01, "known_to_step_end": 0.004, "smooth_if_held": None},
    ],
}


def test_verdict_begins_with_the_worst_error_of_the_plain_call() -> None:
    measured = {"validation": {"in range": in_range()}, "plain_call": PLAIN}
    lines = verdict(run_figures(**measured), SUBJECT)
    assert lines[0] == (
        "Relative RMSE of the plain call, fmpy.simulate_fmu with output_interval = 0.02: up to "
        "1.4 % under smooth inputs, up to 3 % under inputs as in the training."
    )
    assert lines[1] == (
        "With inputs known to the step's end: up to 0.4 %. An input that jumps acts like a ramp "
        "over one step, half of one late or early. Networks learn that with data.jumps = true in "
        "the recipe (init --jumps)."
    )
    planned = verdict(run_figures(**measured), replace(SUBJECT, planned=True))
    assert planned[1] == "With inputs known to the step's end: up to 0.4 %."
    assert "force -100 .. 100 N, ratio 0 .. 1)" in lines[3]
    assert lines[-1].endswith(
        "depend on the inputs of the last 15 s, and its bound counts from 18.5 s on."
    )
    unbounded = verdict(run_figures(**measured), replace(SUBJECT, filling=None))
    assert unbounded[-1].endswith("depend on the inputs of the last 15 s.")


def test_verdict_names_the_error_of_the_worst_smooth_motion() -> None:
    outputs = [
        {**o, "smooth_worst": w} for o, w in zip(PLAIN["outputs"], (0.02, 0.03), strict=True)
    ]
    measured = {
        "validation": {"in range": in_range()},
        "plain_call": {**PLAIN, "outputs": outputs},
    }
    first = verdict(run_figures(**measured), SUBJECT)[0]
    assert "up to 1.4 % under smooth inputs (3 % in the worst motion), up to 3 % under" in first


def test_held_inputs_say_what_a_smooth_one_would_cost() -> None:
    held = {"rough": 0.01, "smooth": None, "known_to_step_end": None, "smooth_if_held": 0.18}
    plain = {**PLAIN, "late_s": 0.0625, "outputs": [held]}
    measured = {"validation": {"in range": in_range()}, "plain_call": plain}
    assert "late by 0.0625 s: 18 % at 0.1 to 1 Hz." in verdict(run_figures(**measured), SUBJECT)[1]


def test_own_error_that_counts_is_not_told_as_lateness() -> None:
    held = {"rough": 0.1, "smooth": None, "known_to_step_end": None, "smooth_if_held": 0.18}
    plain = {**PLAIN, "late_s": 0.0625, "outputs": [held]}
    measured = {"validation": {"in range": in_range()}, "plain_call": plain}
    assert verdict(run_figures(**measured), SUBJECT)[1] == (
        "Inputs are held over each step. A smooth input is late by 0.0625 s; under it, the FMU "
        "has an error of 18 % at 0.1 to 1 Hz, its own error included."
    )


def test_bound_says_what_it_covers_where_users_drive() -> None:
    bound = {"confidence": 0.95, "outputs": [{"coverage": 0.95, "width": 0.5}]}
    smooth = [{**output, "smooth_covered": 0.84} for output in PLAIN["outputs"]]
    measured = {
        "validation": {"in range": in_range(error_bound=bound)},
        "plain_call": {**PLAIN, "outputs": smooth},
        "box": {"corners": {"outputs": [{"relative_rmse": 0.01, "covered": 0.75},
                                        {"relative_rmse": 0.01, "covered": 1.0}]}},
    }  # fmt: skip
    line = next(line for line in verdict(run_figures(**measured), SUBJECT) if "Its error" in line)
    assert line == (
        "Its error bound of 95 % covers 95 % of the samples, 84 % under smooth inputs, 75 % to "
        "100 % at the corners. On average it is 0.5 times as large as the constant that covers "
        "95 % of the errors."
    )
    jumps = "The bound includes that with data.jumps = true"
    assert any(jumps in line for line in verdict(run_figures(**measured), SUBJECT))


def test_output_whose_error_is_far_above_the_others_is_named() -> None:
    force = {"name": "force", "rough": 0.3, "smooth": 0.01, "known_to_step_end": 0.003}
    sway = {"name": "sway", "rough": 0.002, "smooth": 0.01, "known_to_step_end": 0.002}
    outputs = [{**output, "smooth_if_held": None} for output in (force, sway)]
    plain = {**PLAIN, "outputs": outputs}
    measured = {"validation": {"in range": in_range()}, "plain_call": plain}
    first = verdict(run_figures(**measured), SUBJECT)[0]
    at_once = "(force, which follows inputs within a step; the others up to 0.2 %)."
    assert first.endswith(f"up to 30 % under inputs as in the training {at_once}")
    fact = verdict_of(run_figures(**measured), SUBJECT).facts[0]
    assert "of force in the plain call, on unseen inputs; the others up to 0.2 %." in fact.text


def test_bound_that_says_less_than_a_constant_is_told() -> None:
    outputs = [{"name": "speed", "coverage": 0.95, "width": 0.7, "skill": 0.2},
               {"name": "current", "coverage": 0.95, "width": 1.4, "skill": -0.13}]  # fmt: skip
    bound = {"confidence": 0.95, "outputs": outputs}
    lines = verdict(run_figures(validation={"in range": in_range(error_bound=bound)}), SUBJECT)
    line = next(line for line in lines if "bound" in line)
    assert line.endswith("% of the errors; for current a constant bound says more.")


def test_kinds_of_the_training_that_are_not_valid_are_named() -> None:
    harms = {
        "sweep": (0.0, 0.0, 1.0),
        "held_random": (0.06, 0.06, 0.8),
        "steps": (0.01, 0.02, 0.9),
    }
    kinds = [{"name": name, "harm": {"harmful": h, "harmful_unnoticed": u, "harmful_flagged": f}}
             for name, (h, u, f) in harms.items()]  # fmt: skip
    bound = {"confidence": 0.95, "excitations": kinds,
             "outputs": [{"name": "y", "coverage": 0.95, "width": 0.7}]}  # fmt: skip
    errors = [{"name": "held_random", "relative_rmse": [0.01, 0.03]},
              {"name": "steps", "relative_rmse": [0.02]}]  # fmt: skip
    measured = in_range(error_bound=bound, excitations=errors)
    lines = verdict(run_figures(validation={"in range": measured}), SUBJECT)
    valid = next(line for line in lines if line.startswith("Valid"))
    assert (
        ", except held_random (3 %, 80 % of the harmful samples flagged), steps (2 %, 90 %)."
        in valid
    )
    assert valid.endswith("or a mix of fewer kinds, may mend this.")


def test_valid_kinds_that_the_bound_covers_too_seldom_are_named() -> None:
    def kinds(**shares: tuple[float, float]) -> dict[str, Any]:
        """Kinds with their harmful and their covered share."""
        found = [{"name": name, "coverage": [0.99, covered],
                  "harm": {"harmful": harmful, "harmful_unnoticed": 0.0}}
                 for name, (harmful, covered) in shares.items()]  # fmt: skip
        outputs = [{"name": "y", "coverage": 0.95, "width": 0.7}]
        return {"confidence": 0.95, "excitations": found, "outputs": outputs}

    learnt = in_range(error_bound=kinds(sweep=(0.0, 0.931), rest=(0.0, 0.92), steps=(0.1, 0.5)))
    others = in_range(error_bound=kinds(binary=(0.01, 0.872), noise=(0.0, 0.96)), held_out=True)
    found = verdict(run_figures(validation={"in range": learnt, "others": others}), SUBJECT)
    (valid,) = (line for line in found if line.startswith("Valid"))
    ending = "Its bound covers less than 93 % of the samples of rest (92 %), binary (87.2 %)."
    assert valid.endswith(ending)
    beyond = {**others, "amplitude": [1.0, 2.0], "held_out": False}
    found = verdict(run_figures(validation={"in range": learnt, "beyond": beyond}), SUBJECT)
    assert any(line.endswith("of the samples of rest (92 %).") for line in found)


def test_error_of_records_is_that_of_both_calls() -> None:
    outputs = [{"relative_rmse": 0.00544, "plain_relative_rmse": 0.00792}]
    lines = verdict(run_figures(validation={"in range": in_range(outputs=outputs)}), SUBJECT)
    assert lines[0] == (
        "Relative RMSE on inputs that no training saw: 0.792 % in the plain call, "
        "fmpy.simulate_fmu, and 0.544 % with inputs known to the step's end (slide_fmu.simulate)."
    )


def test_bound_estimate_corners_speed_and_limits_are_named() -> None:
    bound = {"confidence": 0.95, "outputs": [{"coverage": 0.956, "width": 0.61},
                                             {"coverage": 0.941, "width": None}]}  # fmt: skip
    deviations = [{"mean": 0.4, "constant_mean": 0.6}]
    estimate = {"without_floor": deviations, "plain": [{"mean": 0.51, "constant_mean": 0.57}]}
    solved = {"model": "reference", "solver": "RK45", "setting": "rtol = 1e-3", "seconds": 0.24}
    speed = {"finest": {**solved, "relative_error": 0.0}, "relative_error": 0.02, "seconds": 1e-3,
             "loosened": {**solved, "relative_error": 0.01}, "ratio": 240.0,
             "can_be_loosened": True, "complete": True}  # fmt: skip
    timing = {"fmu_step_us": 5.0, "speed": speed}
    outputs = [{"relative_rmse": 0.01}]
    measured = {
        "validation": {
            "beyond the range": {**in_range(), "amplitude": [1.0, 3.0]},
            "in range": in_range(error_bound=bound, error_estimate=estimate, timing=timing),
            "kinds that were held out": in_range(held_out=True),
        },
        "box": {"corners": {"points": 4, "outputs": outputs}},
    }
    lines = verdict(run_figures(**measured), SUBJECT)
    text = " ".join(lines)
    assert len(lines) <= 7
    assert lines[0].startswith("Relative RMSE: up to 0.4 %")
    assert "1 % at the corners of the inputs' ranges" in text
    assert "of 95 % covers 94.1 % to 95.6 % of the samples. On average it is up to 0.61" in text
    assert "differs from the true error by 40 %; the best constant estimate would" in text
    assert "differ by 60 %. In the plain call, these are 51 % and 57 %." in text
    assert "its model takes 240 times as long: RK45 with rtol = 1e-3 has an error of 1 %" in text
    assert "1 to 3 times the amplitude: 0.4 %" in text
    assert "Other kinds of input that were measured: 0.4 %" in text


def test_bound_that_covers_less_in_the_plain_call_says_so() -> None:
    bound = {
        "confidence": 0.95,
        "outputs": [{"coverage": 0.96, "width": 0.6}],
        "plain": {"coverage": [0.65]},
    }
    lines = verdict(run_figures(validation={"in range": in_range(error_bound=bound)}), SUBJECT)
    text = "96 % of the samples with inputs known to the step's end, 65 % in the plain call"
    assert any(text in line for line in lines)


def test_harm_of_the_plain_call_is_named_where_it_is_another_one() -> None:
    def harm(harmful: float, flagged: float | None) -> dict[str, Any]:
        shares = {"harmful_flagged": flagged, "harmful_unnoticed": 0.007}
        return {"harmful": harmful, "harmless_flagged": 0.3, **shares}

    def line_of(of_plain: dict[str, Any]) -> str:
        bound = {
            "confidence": 0.95,
            "outputs": [{"coverage": 0.96, "width": 0.6}],
            "harm": harm(0.01, 0.5),
            "plain": {"coverage": [0.95], "untrusted": 0.47, "harm": of_plain},
        }
        figures = run_figures(validation={"in range": in_range(error_bound=bound)})
        (line,) = (one for one in verdict(figures, SUBJECT) if "bound of 95 %" in one)
        return line

    assert line_of(harm(0.18, 0.96)).endswith(
        "95 % of the errors. In the plain call, trusted is false in 47 % of the samples, 18 % are "
        "harmful (96 % of these flagged), and 0.7 % are harmful and unnoticed."
    )
    assert "0 % are harmful, and" in line_of(harm(0.0, None))
    assert "harmful" not in line_of(harm(0.01, 0.5))


def test_nothing_measured_gives_no_verdict() -> None:
    assert verdict(None, SUBJECT) == ()
