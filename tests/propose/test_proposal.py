"""A first recipe is proposed for a model of the user, and is tried."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from slide_fmu.cli.app import app
from slide_fmu.core.search_path import make_importable
from slide_fmu.core.signals import Signal
from slide_fmu.excitation.recorded import Recorded
from slide_fmu.fmu.export import export_fmu
from slide_fmu.memory import motions
from slide_fmu.propose import first_look, lasting_tones
from slide_fmu.propose.draft_signals import Ranges, parse_bands, parse_range
from slide_fmu.propose.frequencies import bands_of
from slide_fmu.propose.proposal import InitOptions, Proposal, propose
from slide_fmu.recipe.reading import load_open_recipe, parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.systems.errors import LoadError
from tests.fmu.samples import sum_surrogate
from tests.libraries import build_libraries
from tests.own_models.quarter_car import build_in_c, build_in_python
from tests.progress import silent
from tests.refusals import refused

LAG = '''
"""A lag of first order: the output follows the input with the time constant of 0.5 s."""

inputs = {"force": "N", "spare": {"unit": "N", "range": [0.0, 1.0]}}
outputs = {"position": "m", "double": {"unit": "m", "range": [-9.0, 9.0]}}
parameters = {"time_constant": 0.5}
start = [0.0]


def f(x, u, p):
    return [(u[0] + 0.1 * u[1] - x[0]) / p.time_constant]


def g(x, u, p):
    return [x[0], 2 * x[0]]
'''


FORCE: Ranges = {"force": (-2.0, 2.0)}
ROAD: Ranges = {"road": (-0.1, 0.1)}


@pytest.fixture
def here(brief: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, in which models are looked at for a short time."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def lag(here: Path) -> Path:
    return written(here / "slow_lag.py", LAG)


def proposed(model: Path, inputs: Ranges | None = None, **options: Any) -> Proposal:
    """What is proposed for a model, with these options; its inputs are a force by default."""
    ranges = FORCE if inputs is None else inputs
    return propose(InitOptions(str(model), ranges, **options), silent)


def recipe_of(proposal: Proposal) -> Recipe:
    return parse_open_recipe(proposal.text, "proposal").guess


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(app, list(arguments))


def test_proposed_recipe_says_what_was_found_and_assumed(lag: Path) -> None:
    found = proposed(lag, outputs=("position",), step=0.1)
    recipe = recipe_of(found)
    assert (recipe.name, recipe.system.kind) == ("slow_lag", "function")
    assert recipe.system.model == "slow_lag.py"
    # a function takes all its inputs: the one that was not named has the range of the model
    assert list(recipe.system.inputs) == ["force", "spare"]
    assert recipe.system.inputs["force"].range == (-2.0, 2.0)
    assert recipe.system.inputs["spare"].range == (0.0, 1.0)
    assert recipe.system.inputs["force"].hold == "first_order"
    low, high = recipe.system.outputs["position"].range or (0.0, 0.0)
    assert -3.5 < low < -0.5
    assert 0.5 < high < 3.5
    assert recipe.data.substeps == 4  # its inputs move, and bend between samples
    assert "# time_constant = 0.5" in found.text
    assert "# The range was given." in found.text


@pytest.mark.parametrize(
    ("unit", "wanted", "jumps"),
    [("N", None, True), ("N", False, False), ("mm", None, False), ("mm", True, True)],
)
def test_forces_jump_and_lengths_do_not_unless_users_say_so(
    here: Path, unit: str, wanted: bool | None, jumps: bool
) -> None:
    """In motions of a model with an input in N, and another one in this unit."""
    lag = written(here / "slow_lag.py", LAG.replace('"unit": "N"', f'"unit": "{unit}"'))
    found = proposed(lag, outputs=("position",), step=0.1, jumps=wanted)
    recipe = recipe_of(found)
    assert recipe.data.jumps is jumps
    assert ("\n# jumps = true\n" in found.text) is not jumps
    assert ("stops" in {kind.kind for kind in recipe.data.excitation}) is jumps


SPRING = '''
"""A mass on a spring, with its resonance at 1.59 Hz."""

inputs = {"force": "N"}
outputs = {"position": "m"}
start = [0.0, 0.0]


def f(x, u, p):
    return [x[1], u[0] - 2.0 * x[1] - 100.0 * x[0]]


def g(x, u, p):
    return [x[0]]
'''


@pytest.fixture
def spring(here: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(lasting_tones, "LINES", 512)  # enough for its resonance
    return written(here / "spring.py", SPRING)


def frequencies(proposal: Proposal) -> list[tuple[float, ...]]:
    kinds = recipe_of(proposal).data.excitation
    return [getattr(kind, "angular_frequency", ()) for kind in kinds]


def asks_for_band(proposal: Proposal) -> list[str]:
    return [remark for remark in proposal.remarks if "--band" in remark]


def test_proposal_names_resonances_and_has_sines_near_them(spring: Path) -> None:
    found = proposed(spring, step=0.02)
    assert "among them tones that last at 1.5" in " ".join(found.text.replace("#", "").split())
    (near,) = [ends for ends in frequencies(found) if ends[:1] == (6.9,)]
    assert near[1] == pytest.approx(14.0, rel=0.03)
    assert not asks_for_band(found)


@pytest.mark.extended
def test_proposal_names_the_line_that_accepts_one_state_alone(spring: Path) -> None:
    written(spring, SPRING.replace("[x[1], u[0]", "[x[1] if x[1] > 0 else x[1], u[0]"))
    found = proposed(spring, step=0.02)
    (remark,) = [one for one in found.remarks if "for each motion alone" in one]
    assert "spring.py, line 10)" in remark


@pytest.mark.extended
def test_proposal_asks_for_working_frequencies_where_rates_limit_the_sines(spring: Path) -> None:
    spring.write_text(
        SPRING.replace("u, p):\n    return [x[1], u[0]", "u, p, du):\n    return [x[1], du[0]")
    )
    (remark,) = asks_for_band(proposed(spring, step=0.02))
    assert remark.startswith("sines reach through the whole range up to 0.939 Hz, and a part")
    assert not asks_for_band(proposed(spring, step=0.02, bands={"": (1.0, 2.0)}))


def test_proposal_for_a_working_band_has_motions_there(spring: Path) -> None:
    found = proposed(spring, step=0.02, bands=parse_bands(["3..6.5"]))
    assert frequencies(found).count((19.0, 41.0)) == 3
    assert not asks_for_band(found)


def test_band_of_which_the_step_has_too_few_samples_is_refused(spring: Path) -> None:
    with refused(RecipeError, "--band force=3..20", "2.5 samples in a period", "--step 0.005"):
        proposed(spring, step=0.02, bands={"force": (3.0, 20.0)})


def test_band_of_an_input_that_there_is_not_is_refused(spring: Path) -> None:
    with refused(RecipeError, "--band forse=3..20: there is no input 'forse'", "of force"):
        proposed(spring, step=0.02, bands={"forse": (3.0, 20.0)})
    with refused(RecipeError, "--band force is given twice"):
        parse_bands(["force=1..2", "force=1..3"])


def test_bands_of_inputs_stand_beside_that_of_all_others() -> None:
    signals = [Signal(name, "N", -1.0, 1.0) for name in ("torque", "load", "speed")]
    bands = parse_bands(["torque=5..20", "0.1..1"])
    assert bands_of(bands, signals) == [(5.0, 20.0), (0.1, 1.0), (0.1, 1.0)]
    assert bands_of(parse_bands(["load=3..4"]), signals) == [None, (3.0, 4.0), None]
    assert bands_of({}, signals) == []


@pytest.mark.parametrize("text", ["", "3", "6..3", "0..5", "1..inf", "a..b", "=1..2"])
def test_band_that_is_none_is_refused(text: str) -> None:
    with refused(RecipeError, f"--band {text}", "two positive frequencies in Hz"):
        parse_bands([text])


@pytest.mark.extended
def test_jumps_of_inputs_that_are_held_are_refused(lag: Path) -> None:
    with refused(RecipeError, "--jumps", "held over each step", "leave it out"):
        proposed(lag, step=0.1, hold="zero_order", jumps=True)


@pytest.mark.extended
def test_proposal_for_inputs_that_are_held_has_no_substeps(lag: Path) -> None:
    found = proposed(lag, outputs=("position",), step=0.1, hold="zero_order")
    assert recipe_of(found).data.substeps == 1


@pytest.mark.extended
@pytest.mark.parametrize(
    ("step", "found", "substeps"), [(None, 0.002, 2), (0.02, 0.02, 4), (0.007, 0.007, 7)]
)
def test_proposal_for_an_fmu_that_is_run_by_steps_has_whole_ones(
    here: Path, step: float | None, found: float, substeps: int
) -> None:
    car = build_in_python(here / "car.fmu")
    proposal = proposed(car, ROAD, outputs=("suspension_travel",), step=step, fmu_step=1e-3)
    recipe = recipe_of(proposal)
    assert recipe.window.step == pytest.approx(found)
    assert recipe.system.parameters == {"fmu-step": 1e-3}
    assert recipe.data.substeps == substeps
    assert "the FMU names no unit of road, suspension_travel: " in " ".join(proposal.remarks)
    assert proposal.text.count('\n# unit = "N"  # the model names none') == 2
    assert len(set(proposal.remarks)) == len(proposal.remarks)


@pytest.mark.extended
@pytest.mark.parametrize(
    ("step", "hold", "parameters", "substeps"),
    [(None, "zero_order", {}, 1), (0.02, "first_order", {"fmu-step": 0.005}, 4)],
)
def test_fmu_that_names_its_step_is_proposed_as_an_importer_runs_it(
    here: Path,
    step: float | None,
    hold: str,
    parameters: dict[str, float],
    substeps: int,
) -> None:
    """Over its own step its inputs are held; over a longer one they move by such steps."""
    car = build_in_c(here / "car.fmu", co_simulation=True)
    found = proposed(car, ROAD, outputs=("suspension_travel",), step=step)
    recipe = recipe_of(found)
    assert recipe.window.step == (step or 0.005)
    assert recipe.system.inputs["road"].hold == hold
    assert recipe.system.parameters == parameters
    assert recipe.data.substeps == substeps
    assert sum("its inputs" in remark for remark in found.remarks) == 1
    assert any("are held over each" in remark for remark in found.remarks)


def test_step_that_is_no_whole_number_of_an_importers_is_refused(tmp_path: Path) -> None:
    car = build_in_python(tmp_path / "car.fmu")
    with refused(RecipeError, "--step 0.05 with --fmu-step 0.003", "--step 0.051"):
        proposed(car, ROAD, step=0.05, fmu_step=0.003)


def test_step_of_an_fmu_is_refused_for_other_models(lag: Path) -> None:
    with refused(RecipeError, "--fmu-step 0.001 for", "expected a positive number"):
        proposed(lag, fmu_step=1e-3)


@pytest.mark.extended
def test_input_that_changes_no_output_is_named(lag: Path) -> None:
    assert not any("changes no output" in one for one in proposed(lag, step=0.1).remarks)
    # an even system answers the same to an input of the opposite sign
    even = written(lag.with_name("even.py"), LAG.replace("u[0] + 0.1 * u[1]", "u[0] ** 2"))
    remarks = proposed(even, step=0.1).remarks
    assert [one for one in remarks if "changes no output" in one] == [
        "input 'spare' changes no output: the surrogate does not need it"
    ]


def test_proposal_takes_all_signals_where_none_are_named(lag: Path) -> None:
    found = recipe_of(proposed(lag, {**FORCE, "spare": None}, step=0.1))
    assert list(found.system.inputs) == ["force", "spare"]
    assert list(found.system.outputs) == ["position", "double"]
    assert found.system.outputs["double"].range == (-9.0, 9.0)


@pytest.mark.parametrize(
    ("inputs", "outputs", "message"),
    [
        (
            {},
            (),
            r"input 'force' \(N\): the model declares no range; .* --input force=LOW\.\.HIGH",
        ),
        (
            {"spare": (0.0, 2.0)},
            (),
            r"input 'force' \(N\): the model declares no range; .* --input force=LOW\.\.HIGH",
        ),
        ({"power": None}, (), r"--input power: .* expected some of \['force', 'spare'\]"),
        (
            {"force": (-1.0, 1.0)},
            ("speed",),
            r"--output speed: .* expected some of \['position', 'double'\]",
        ),
    ],
)
def test_proposal_without_what_it_needs_is_refused(
    lag: Path, inputs: Ranges, outputs: tuple[str, ...], message: str
) -> None:
    with pytest.raises(RecipeError, match=message):
        proposed(lag, inputs, outputs=outputs)


CLASS = '''
"""A lag that declares its signals itself."""

import numpy as np

import slide_fmu as slide


class Lag(slide.System):
    def __init__(self, *, step):
        self.step = step
        self.inputs = (slide.Signal("u", "1", -1.0, 1.0),)
        self.outputs = (slide.Signal("y", "1", -1.5, 1.5), slide.Signal("z", "1", -1.0, 2.5))

    def simulate(self, inputs):
        kept, values = np.exp(-self.step), [inputs[0, 0]]
        for u in inputs[:, 0]:
            values.append(kept * values[-1] + (1 - kept) * u)
        return np.array([values, values]).T
'''


@pytest.mark.parametrize(
    ("inputs", "outputs", "message"),
    [
        (
            {"u": (-3.0, 3.0)},
            (),
            r"--input u=-3\.\.3: a class declares .* has the inputs u \(-1\.\.1\); expected no "
            r"--input: leave it out, or change self\.inputs in the class",
        ),
        (
            {},
            ("z",),
            r"--output z: a class .* outputs y \(-1\.5\.\.1\.5\), z \(-1\.\.2\.5\); expected no",
        ),
    ],
)
def test_choice_among_the_signals_of_a_class_is_refused(
    here: Path, inputs: Ranges, outputs: tuple[str, ...], message: str
) -> None:
    path = written(here / "lag.py", CLASS)
    with pytest.raises(RecipeError, match=message):
        proposed(path, inputs, outputs=outputs, step=0.1)
    found = recipe_of(proposed(path, {}, step=0.1))
    assert (Path(found.system.model).name, found.system.inputs) == ("lag.py:Lag", {})


@pytest.mark.extended
def test_fmu_of_slide_fmu_is_proposed_with_the_signals_of_its_surrogate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(first_look, "SAMPLES", 50)
    build_libraries()
    fmu = export_fmu(sum_surrogate(16), tmp_path / "window_sum.fmu")
    proposal = proposed(fmu, {})
    found = recipe_of(proposal)
    assert list(found.system.outputs) == ["y"]
    assert found.system.outputs["y"].range == (-1.0, 9.0)
    assert found.system.inputs["u"].hold == "zero_order"  # though the FMU can interpolate it
    assert found.window.step == sum_surrogate(16).window.step
    assert any("slide-fmu wrote this FMU" in remark for remark in proposal.remarks)
    other = recipe_of(proposed(fmu, {}, outputs=("window_filled",)))
    assert list(other.system.outputs) == ["window_filled"]
    step = sum_surrogate(16).window.step
    by_steps = recipe_of(proposed(fmu, {}, fmu_step=step / 4))
    assert by_steps.system.inputs["u"].hold == "zero_order"  # it stays what the model declares
    assert by_steps.system.parameters == {"fmu-step": step / 4}
    assert by_steps.data.substeps == 1


def test_model_of_no_kind_is_refused(tmp_path: Path) -> None:
    with refused(LoadError, "expected an FMU", "known kind"):
        proposed(written(tmp_path / "nothing.py", "x = 1\n"))


def test_model_that_cannot_be_run_is_named_with_its_line(tmp_path: Path) -> None:
    path = written(tmp_path / "broken.py", "import numpy\n\nvalue = 1 / 0\n")
    with refused(LoadError, "ZeroDivisionError", "broken.py, line 3"):
        proposed(path)


@pytest.mark.parametrize("text", ["force=1", "force=2..1", "force=a..b", "=1..2", "force=1..1"])
def test_range_that_is_none_is_refused(text: str) -> None:
    with refused(RecipeError, "expected NAME=LOW..HIGH"):
        parse_range([text])


def test_name_that_no_recipe_can_have_is_refused(lag: Path) -> None:
    with refused(RecipeError, "expected a letter", "--name 'a", "--name a_b"):
        proposed(lag, name="a b")


def test_signal_that_is_given_twice_is_refused(lag: Path) -> None:
    with refused(RecipeError, "--input force is given twice"):
        parse_range(["force=0..1", "force=0..2"])
    with refused(RecipeError, "--output position is given twice"):
        proposed(lag, outputs=("position", "position"))


def test_ranges_are_read_in_their_order() -> None:
    assert parse_range(["b=-1..2.5", "a"]) == {"b": (-1.0, 2.5), "a": None}


def test_recipe_that_is_there_is_refused_before_the_model_is_run(tmp_path: Path) -> None:
    (tmp_path / "model.toml").write_text("")
    result = invoke("init", str(tmp_path / "absent.py"), "-o", str(tmp_path / "model.toml"))
    assert result.exit_code == 1
    assert "exists already" in result.output


@pytest.mark.parametrize("name", ["slow_lag.py", "slow_lag.py:Lag", "sub/../slow_lag.py"])
def test_model_is_never_replaced_by_its_recipe(lag: Path, tmp_path: Path, name: str) -> None:
    (tmp_path / "sub").mkdir()
    before = Path("slow_lag.py").read_bytes()
    result = invoke("init", name, "-o", "slow_lag.py", "--force")
    assert result.exit_code == 1
    assert "is the model's own file" in result.output
    assert Path("slow_lag.py").read_bytes() == before


INIT = "init", "slow_lag.py", "--input", "force=-2..2", "-o", "recipes/lag.toml"


def test_init_writes_a_recipe_once_and_names_the_next_command(lag: Path) -> None:
    done = invoke(*INIT)
    assert done.exit_code == 0, done.output
    assert "next    slide-fmu try recipes/lag.toml" in done.output
    recipe = load_open_recipe("recipes/lag.toml").guess
    assert recipe.system.model == "../slow_lag.py"
    again = invoke(*INIT)
    assert again.exit_code == 1
    assert "recipes/lag.toml exists already" in again.output


@pytest.mark.extended
def test_try_gives_figures_of_the_recipe_that_init_wrote(lag: Path, tmp_path: Path) -> None:
    assert invoke(*INIT).exit_code == 0
    with (tmp_path / "recipes/lag.toml").open("a", encoding="utf-8") as recipe:
        recipe.write("\n[apps.pages]\n")
    tried = invoke("try", "recipes/lag.toml", "--json", "figures.json")
    for part in (
        " s to decay",
        "each after a burn-in of",
        "number of processes: ",
        "[apps.pages]",
    ):
        assert part in " ".join(tried.output.split())
    assert tried.exit_code == 0, tried.output
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert figures["window"]["sufficient"]
    # to a thousandth the lag forgets in 0.5 s ln(1000)
    assert figures["window"]["decay_time_s"]["worst"] == pytest.approx(3.45, rel=0.05)
    assert figures["system"]["offers"]["linearization"]
    assert figures["data"]["expected_wall_time_s"] > 0
    assert "trial: 0 of 4\n" in tried.output
    assert "recipe: " not in tried.output  # the trial has one progress
    assert "trial: 4 of 4, took " in tried.output
    assert "next    slide-fmu run recipes/lag.toml" in tried.output


@pytest.mark.parametrize("kind", ["function", "exudyn"])
def test_init_writes_a_small_model_that_runs(
    kind: str, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(first_look, "SAMPLES", 100)
    name = f"first_{kind}_model"  # the folder of one case can still be imported from in the other
    done = invoke("init", "--kind", kind, name, "--step", "0.02")
    assert done.exit_code == 0, done.output
    assert (here / f"{name}.py").exists()
    recipe = load_open_recipe(f"{name}.toml").guess
    assert (recipe.system.kind, recipe.window.step) == (kind, 0.02)


@pytest.mark.parametrize("name", ["my-model", "2nd_model", "models/my-model.py"])
def test_new_model_of_a_name_that_python_cannot_import_is_refused(name: str, here: Path) -> None:
    done = invoke("init", "--kind", "function", name)
    assert done.exit_code == 1
    assert f"a new one cannot be called {Path(name).stem!r}; expected letters" in done.output
    assert "choose a name such as m" in done.output
    assert list(here.iterdir()) == []


def test_new_model_does_not_hide_an_installed_module(here: Path) -> None:
    done = invoke("init", "--kind", "function", "numpy")
    assert done.exit_code == 1
    assert "error: system 'numpy' defines neither f nor simulate" in done.output
    assert list(here.iterdir()) == []


SHORT = """
name = "lag"
description = "a lag"

[system]
kind = "function"
model = "slow_lag.py"

[system.inputs.force]
range = [-2.0, 2.0]

[system.inputs.spare]
range = [0.0, 1.0]

[system.outputs.position]
range = [-2.0, 2.0]

[window]
step = 0.1
n_in = 12
n_out = 2

[data]
duration = 4.0
burn_in = 1.0
train = 2
validation = 1
"""


@pytest.mark.extended
def test_window_that_is_too_short_is_told_once(
    lag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(motions, "MOTIONS", 12)
    monkeypatch.setattr(motions, "LINEARIZED_MOTIONS", 4)
    (tmp_path / "lag.toml").write_text(SHORT)
    done = invoke("try", "lag.toml")
    assert done.exit_code == 1
    assert done.output.count("are truncated, but initial effects need") == 1
    (tmp_path / "lag.toml").write_text(SHORT.replace("n_out = 2", "n_out = 2\nallow_short = true"))
    allowed = invoke("try", "lag.toml")
    assert allowed.exit_code == 0
    assert allowed.output.count("are truncated, but initial effects need") == 1


def write_drive(folder: Path, force: float = 1.5, names: str = "time,force,spare") -> Path:
    """A file of inputs, whose spare reaches 0.9 of the model's 1."""
    path = folder / "drive.csv"
    rows = [f"{0.05 * k},{force * math.sin(0.1 * k)},{0.9 * (k % 2)}" for k in range(400)]
    path.write_text("\n".join([names, *rows]) + "\n", encoding="utf-8")
    return path


def test_a_file_of_inputs_gives_ranges_a_kind_and_a_judge(lag: Path) -> None:
    write_drive(lag.parent)
    (lag.parent / "recipes").mkdir()
    result = invoke(
        "init", str(lag), "--inputs", "drive.csv", "--step", "0.1", "-o", "recipes/lag.toml"
    )
    assert result.exit_code == 0, result.output
    assert "drive.csv lasts 19.95 s: the training learns from its first half" in result.output
    make_importable(lag.parent / "recipes", Path.cwd())
    recipe = load_open_recipe("recipes/lag.toml").guess
    assert recipe.system.inputs["force"].range == (-2.1, 2.1)  # 1.5 and a fifth of 3 on both sides
    assert recipe.system.inputs["spare"].range == (0.0, 1.0)  # declared by the model
    *_, file = recipe.data.excitation
    assert isinstance(file, Recorded)
    assert (file.path, file.learnt) == ("../drive.csv", 0.5)
    assert file.weight / sum(kind.weight for kind in recipe.data.excitation) == pytest.approx(
        0.25, abs=0.01
    )


@pytest.mark.parametrize(
    ("force", "names", "given", "words"),
    [
        (1.5, "time,power,spare", (), ("no columns ['force']", "a column for each of")),
        (1.5, "time,force,spare", ("force=-1..1",), ("'force' = 1.49", "-1 .. 1 N", "widen")),
        (math.nan, "time,force,spare", (), ("'force' is no finite number", "fill the gap")),
    ],
)
def test_a_file_that_does_not_fit_is_refused_before_the_model_is_simulated(
    lag: Path, force: float, names: str, given: tuple[str, ...], words: tuple[str, ...]
) -> None:
    write_drive(lag.parent, force, names)
    options = [text for one in given for text in ("--input", one)]
    result = invoke("init", str(lag), "--inputs", "drive.csv", *options)
    assert result.exit_code == 1
    text = " ".join(result.output.split())
    assert all(word in text for word in words), text
    assert "motions" not in text
