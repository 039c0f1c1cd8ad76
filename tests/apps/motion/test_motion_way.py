"""`slide-fmu motion` writes set points and a report, and refuses what does not fit, in words."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.acceptance.conftest import invoke

ROOT = Path(__file__).parents[3]
DUFFING = ROOT / "fmus" / "duffing" / "duffing.fmu"
TASK = {"start": "[0.0]", "goal": "[600.0]", "tolerance": "2e-3"}


def write_task(folder: Path, **changes: str) -> Path:
    lines = [f"{key} = {value}" for key, value in {**TASK, **changes}.items()]
    path = folder / "task.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_motion_writes_set_points_that_the_reference_model_confirms(tmp_path: Path) -> None:
    task, place = write_task(tmp_path), tmp_path / "a motion"
    done = invoke("motion", DUFFING, task, "-o", place, "--verify", "--json", "-")
    assert done.exit_code == 0, done.output
    figures = json.loads(done.stdout)
    names = [row["name"] for row in figures["baselines"]]
    assert names[0] == "not shaped"
    assert any(name.startswith("ZVD") for name in names)
    assert figures["move"]["name"] == "optimised"
    assert figures["margin_is"] == "the error bound of 95 % confidence"
    true = figures["reference"]
    assert true["move"]["residual"] <= 2e-3
    assert true["move"]["settled_s"] < min(row["settled_s"] for row in true["baselines"])
    assert figures == {**json.loads((place / "report.json").read_text()), "seed": 0}
    table = np.genfromtxt(place / "set_points.csv", delimiter=",", names=True)
    assert table.dtype.names == ("time", "force")
    np.testing.assert_allclose(np.diff(table["time"]), 0.03)
    assert (table["force"][0], table["force"][-1]) == (0.0, 600.0)
    assert table["time"][0] == 0
    assert table["time"][-1] == pytest.approx(figures["move"]["arrives_s"])
    page = (place / "report.html").read_text(encoding="utf-8")
    assert "by the reference model" in page
    assert page.count("data-chart=") == 2


@pytest.mark.parametrize("kind", ["choose", "quietest"])
def test_other_kinds_of_tasks_are_answered_too(kind: str, tmp_path: Path) -> None:
    own = (
        {"candidates": "50", "minimise": '"residual"'} if kind == "choose" else {"duration": "0.3"}
    )
    task = write_task(tmp_path, kind=f'"{kind}"', **own)
    done = invoke("motion", DUFFING, task, "-o", tmp_path / kind, "--json", "-")
    assert done.exit_code == 0, done.output
    figures = json.loads(done.stdout)
    least = figures["move"]["residual_with_margin"]
    assert all(least <= row["residual_with_margin"] for row in figures["baselines"])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"goal": "[600.0, 1.0]"},
            "goal has 2 numbers; expected 1, one for each of ['force (N)']",
        ),
        ({"goal": "[1600.0]"}, "goal of force is 1600 N; expected -1000 to 1000"),
        ({"start": "[600.0]"}, "start and goal are both [600.0]; expected two points"),
        ({"tolerance": "-1.0"}, "tolerance"),
        ({"tolerance": "1e-9"}, "tolerance 1e-09 m; no move was found that settles within it"),
        ({"kind": '"fastest"'}, "task.toml: kind = 'fastest'; expected one of 'earliest'"),
        ({"kind": '"quietest"'}, "kind = 'quietest' without duration"),
        ({"duration": "1.0"}, "kind = 'earliest' with duration"),
        ({"kind": '"choose"', "straight": "true"}, "with straight = true; expected it for"),
        ({"start": '["0 N"]'}, "1st value of start = '0 N'"),
        (
            {"kind": '"quietest"', "duration": "0.001"},
            "duration 0.001 s, which are 0 s in whole steps; expected at least 0.03 s",
        ),
        ({"tolerence": "1.0"}, "tolerence"),
        (
            {"candidates": "9"},
            "kind = 'earliest' with ['candidates']; expected these for 'choose'",
        ),
        ({"parameters": "{ mass = 1.0 }"}, "parameter 'mass'; the surrogate has no parameters"),
        ({"via": "[[300.0]]"}, "via alone; expected both via and via_tolerance, or neither"),
        ({"via_tolerance": "[9.0]"}, "via_tolerance alone; expected both"),
        (
            {"via": "[[1600.0]]", "via_tolerance": "[9.0]"},
            "via 1 of force is 1600 N; expected -1000 to 1000",
        ),
        (
            {"via": "[[300.0]]", "via_tolerance": "[9.0, 1.0]"},
            "via_tolerance has 2 numbers; expected 1",
        ),
        (
            {"via": "[[300.0]]", "via_tolerance": "[1e-9]"},
            "expected at most 5000: raise via_tolerance or the limits",
        ),
        ({"limits": "{ speed = [1.0, 2.0] }"}, "limits.speed has 2 numbers; expected 1"),
    ],
)
def test_tasks_that_do_not_fit_are_refused_in_words(
    changes: dict[str, str], message: str, tmp_path: Path
) -> None:
    done = invoke("motion", DUFFING, write_task(tmp_path, **changes), "-o", tmp_path / "no")
    assert done.exit_code == 1
    said = " ".join(done.output.split())
    assert message in said
    assert "Traceback" not in said


def test_a_task_that_is_not_there_or_no_toml_is_named(tmp_path: Path) -> None:
    for text, message in ((None, "absent.toml"), ("start = [", "not valid TOML")):
        path = tmp_path / "absent.toml"
        if text is not None:
            path.write_text(text, encoding="utf-8")
        done = invoke("motion", DUFFING, path)
        assert done.exit_code == 1
        assert message in done.output
        assert "recipe" not in done.output
        assert "training/" not in done.output


def test_a_corrected_path_stands_beside_the_path_as_it_was(tmp_path: Path) -> None:
    robot = ROOT / "fmus" / "robot_6r" / "robot_6r.fmu"
    task, place = ROOT / "docs" / "tutorials" / "closed_path.toml", tmp_path / "path"
    done = invoke("motion", robot, task, "-o", place, "--json", "-")
    assert done.exit_code == 0, done.output
    figures = json.loads(done.stdout)
    found = figures["predicted"]
    assert found["rms_after"] < found["rms_before"] / 1000
    assert found["times_less"] == pytest.approx(found["rms_before"] / found["rms_after"])
    assert max(figures["limits_used"].values()) <= 1
    assert figures["margin_is"].startswith(("the error bound", "twice the error estimate"))
    table = np.genfromtxt(place / "set_points.csv", delimiter=",", names=True)
    assert table.dtype.names == ("time", *(f"joint_{i}" for i in range(1, 7)))
    assert (place / "report.html").read_text(encoding="utf-8").count("data-chart=") == 2


CRANK = ROOT / "fmus" / "slider_crank_payload" / "slider_crank_payload.fmu"
TURN = {
    "start": "[0.0]",
    "goal": "[2.0]",
    "tolerance": "2e-3",
    "limits": "{ speed = [8.0], acceleration = [20.0] }",
}


@pytest.mark.extended
def test_a_motion_is_that_of_the_parameters_of_the_task(tmp_path: Path) -> None:
    """The shapers' responses are those of the reference model with the same mass."""
    left = {}
    for mass in (0.6, 1.4):
        task = write_task(tmp_path, **TURN, parameters=f"{{ slider_mass = {mass} }}")
        done = invoke("motion", CRANK, task, "-o", tmp_path / "m", "--verify", "--json", "-")
        assert done.exit_code == 0, done.output
        figures = json.loads(done.stdout)
        assert figures["task"]["parameters"] == {"slider_mass": mass}
        plain, true = figures["baselines"][0], figures["reference"]["baselines"][0]
        assert plain["residual"] == pytest.approx(true["residual"], rel=0.05)
        left[mass] = plain["residual"]
    assert abs(left[1.4] / left[0.6] - 1) > 0.06


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("{ mass = 1.0 }", "parameter 'mass'; expected one of ['slider_mass']"),
        ("{ slider_mass = 2.6 }", "'slider_mass' = 2.6 kg; expected a number in its range, 0.5"),
        ("{ slider_mass = nan }", "slider_mass"),
    ],
)
def test_parameters_that_do_not_fit_are_refused(values: str, message: str, tmp_path: Path) -> None:
    done = invoke("motion", CRANK, write_task(tmp_path, **TURN, parameters=values))
    assert done.exit_code == 1
    assert message in " ".join(done.output.split())


def test_a_task_may_pass_points_and_says_how_near_it_comes(tmp_path: Path) -> None:
    limits = {"limits": "{ speed = [4000.0] }"}
    task = write_task(tmp_path, via="[[-200.0]]", via_tolerance="[60.0]", **limits)
    done = invoke("motion", DUFFING, task, "-o", tmp_path / "m", "--json", "-")
    assert done.exit_code == 0, done.output
    used = json.loads(done.stdout)["move"]["limits_used"]
    assert 0 < used["via_tolerance"] <= 1
    table = np.genfromtxt(tmp_path / "m" / "set_points.csv", delimiter=",", names=True)
    assert np.abs(table["force"] + 200).min() == pytest.approx(60 * used["via_tolerance"])


def test_a_path_that_is_not_there_is_named(tmp_path: Path) -> None:
    task = tmp_path / "task.toml"
    task.write_text('kind = "compensate"\npath = "absent.csv"\n', encoding="utf-8")
    done = invoke("motion", DUFFING, task)
    assert done.exit_code == 1
    assert "absent.csv" in done.output
