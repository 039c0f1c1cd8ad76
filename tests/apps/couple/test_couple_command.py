"""``slide-fmu couple`` on the command line: an SSP becomes a table, figures and a report."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd

import slide_fmu as slide
from slide_fmu.apps.couple.ssp import read_ssp
from slide_fmu.cosim.ssv import parameter_set, parameters_of
from tests.acceptance.conftest import invoke
from tests.marks import needs_app
from tests.own_models.halves.cut_car import LINKS, road
from tests.refusals import refused

DUFFING = Path(__file__).parents[3] / "fmus" / "duffing" / "duffing.fmu"
STRUCTURE = """<?xml version="1.0" encoding="UTF-8"?>
<SystemStructureDescription xmlns="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
    version="1.0" name="car">
  <System name="car">
    <Elements>
      <Component name="lower" source="resources/lower.fmu"/>
      <Component name="upper" source="resources/upper.fmu">
        <ParameterBindings><ParameterBinding><ParameterValues>
          <ssv:ParameterSet version="1.0" name="parameters"><ssv:Parameters>
            <ssv:Parameter name="mass"><ssv:Real value="25.0"/></ssv:Parameter>
          </ssv:Parameters></ssv:ParameterSet>
        </ParameterValues></ParameterBinding></ParameterBindings>
      </Component>
    </Elements>
    <Connections>
      <Connection startElement="lower" startConnector="force" endElement="upper"
          endConnector="force"/>
      <Connection startElement="upper" startConnector="position" endElement="lower"
          endConnector="body"/>
    </Connections>
  </System>
  <DefaultExperiment stopTime="0.4"/>
</SystemStructureDescription>
"""


@pytest.fixture
def car(halves: dict[str, Path], tmp_path: Path) -> Path:
    """A system of both halves."""
    return write_car(tmp_path / "car.ssp", halves, STRUCTURE)


def write_car(path: Path, halves: dict[str, Path], structure: str) -> Path:
    """Write both halves with a structure."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("SystemStructure.ssd", structure)
        for name, fmu in halves.items():
            archive.write(fmu, f"resources/{name}.fmu")
    return path


def test_ssp_gives_a_table_figures_and_a_report(
    car: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    times, heights = road(0.4)
    np.savetxt("road.csv", np.stack([times, heights], axis=1), delimiter=",", comments="",
               header="time,lower.road")  # fmt: skip
    result = invoke(
        "couple", car, "--step", 0.02, "--inputs", "road.csv", "--moving", "lower",
        "-o", "out.csv", "--json", "figures.json",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    table = np.genfromtxt("out.csv", delimiter=",", names=True, deletechars="")
    assert table["time"][-1] == pytest.approx(0.4)
    assert np.ptp(table["upper.position"]) > 1e-3
    figures = json.loads(Path("figures.json").read_text("utf-8"))
    assert (figures["method"], figures["steps"]) == ("newton", 20)
    page = Path("runs/car/couple/report.html").read_text("utf-8")
    assert "upper.position" in page
    assert "implicit, by Newton" in page


def test_start_values_of_the_ssp_are_used(car: Path, tmp_path: Path) -> None:
    tables = []
    for more in ((), ("--set", "upper.mass=300")):
        arguments = ("--step", 0.02, "--set", "upper.start=0.01", "--moving", "lower", *more)
        place = tmp_path / "out.csv"
        result = invoke("couple", car, *arguments, "-o", place, "--report", tmp_path)
        assert result.exit_code == 0, result.output
        tables.append(np.genfromtxt(place, delimiter=",", names=True, deletechars=""))
    light, heavy = (table["upper.position"][3] for table in tables)
    assert light < heavy < 0.01


def test_ssp_from_python_is_the_same_system(halves: dict[str, Path], tmp_path: Path) -> None:
    given = {"upper.mass": 25.0, "upper.start": 0.01}
    ssp = slide.write_ssp(tmp_path / "car.ssp", halves, LINKS, parameters=given)
    run = slide.couple(halves, LINKS, step=0.02, stop=0.4, parameters=given, moving=["lower"])
    place = tmp_path / "out.csv"
    arguments = ("--step", 0.02, "--stop", 0.4, "--moving", "lower", "-o", place)
    result = invoke("couple", ssp, *arguments, "--report", tmp_path)
    assert result.exit_code == 0, result.output
    table = np.genfromtxt(place, delimiter=",", names=True, deletechars="")
    np.testing.assert_allclose(table["upper.position"], run["upper.position"], rtol=1e-8)
    with refused(ValueError, "'lower.speed'", "expected"):
        slide.write_ssp(tmp_path / "car.ssp", halves, [("lower.speed", "upper.force")])
    with refused(ValueError, "ending in .ssp"):
        slide.write_ssp(tmp_path / "car.zip", halves, LINKS)


def test_ssp_keeps_names_and_types_of_any_kind(tmp_path: Path) -> None:
    crank = DUFFING.parents[1] / "slider_crank" / "slider_crank.fmu"
    names = ["a", "./a", "x/../a", "a b#1", "100%", "Ä" * 300]
    given = {f"{name}.director_x": float(k == 1) for k, name in enumerate(names)}
    given |= {f"{name}.director_y": float(k != 1) for k, name in enumerate(names)}
    ssp = slide.write_ssp(tmp_path / "many.ssp", dict.fromkeys(names, crank), [], parameters=given)
    read_ssd(str(ssp))  # it fits the schema
    with zipfile.ZipFile(ssp) as archive:
        assert all(".." not in name and name.isascii() for name in archive.namelist())
    place = tmp_path / "out.csv"
    arguments = ("--step", 0.03125, "--stop", 0.0625, "-o", place, "--report", tmp_path)
    result = invoke("couple", ssp, *arguments)
    assert result.exit_code == 0, result.output
    table = np.genfromtxt(
        place, delimiter=",", names=True, deletechars="", replace_space=" ", comments=None
    )
    ends = [table[f"{name}.deflection"][-1] for name in names]
    assert [end != ends[0] for end in ends] == [False, True, False, False, False, False]
    for name, value in (("a\x01b", {}), ("a", {"a.prehistory_known": "yes"})):
        with refused(ValueError, "expected"):
            slide.write_ssp(ssp, {name: crank}, [], parameters=value)
    assert zipfile.is_zipfile(ssp)


def test_booleans_and_integers_keep_their_types_in_a_parameter_set() -> None:
    text = parameter_set({"flag": True, "count": 3, "mass": 2.0})
    assert [words in text for words in (b'Boolean value="true"', b'Integer value="3"')] == [
        True
    ] * 2
    assert parameters_of(text, "x.ssv") == {"flag": 1.0, "count": 3.0, "mass": 2.0}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("resources/upper.fmu", "upper.fmu", ("'upper'", "expected an FMU")),
        (
            'startElement="lower" startConnector="force" endElement="upper"',
            'startConnector="force"',
            ("force to force", "connectors of the system at both ends"),
        ),
        ("<Elements>", '<Elements><System name="inner"/>', ("System 'inner'",)),
        ("</System>", "", ("not an SSP file",)),
        ('name="upper" source', 'name="lower" source', ("two components 'lower'",)),
        ("<Elements>", "<ParameterBindings/><Elements>", ("system has Param", "--set")),
        ("<ParameterBinding>", '<ParameterBinding prefix="a.">', ("'upper'", "prefix")),
        ('stopTime="0.4"', 'stopTime="soon"', ("stopTime = 'soon'", "number in s")),
        ('stopTime="0.4"', 'startTime="2" stopTime="3"', ("begins at 2 s", "expected 0")),
    ],
)
def test_structure_that_is_not_known_is_refused(
    halves: dict[str, Path], tmp_path: Path, old: str, new: str, words: tuple[str, ...]
) -> None:
    path = write_car(tmp_path / "car.ssp", halves, STRUCTURE.replace(old, new))
    result = invoke("couple", path, "--step", 0.02)
    assert result.exit_code == 1
    assert [word for word in words if word not in " ".join(result.output.split())] == []


def test_file_that_is_no_fmu_is_named_by_its_place_in_the_ssp(
    halves: dict[str, Path], tmp_path: Path
) -> None:
    (tmp_path / "text.fmu").write_text("no FMU", encoding="utf-8")
    path = write_car(tmp_path / "car.ssp", {**halves, "upper": tmp_path / "text.fmu"}, STRUCTURE)
    result = invoke("couple", path, "--step", 0.02)
    assert result.exit_code == 1
    said = " ".join(result.output.split())
    assert f"component 'upper': {path}/resources/upper.fmu is not an FMU" in said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--error", 0.01), ("error = 0.01 has no effect", "control")),
        (("--extrapolation", "linear"), ("extrapolation = 'linear' has no effect", "'jacobi'")),
        (("--method", "jacobi", "--tolerance", 0.01), ("tolerance = 0.01 has no effect",)),
    ],
)
def test_option_without_effect_is_refused(
    car: Path, arguments: tuple[object, ...], words: tuple[str, ...]
) -> None:
    result = invoke("couple", car, "--step", 0.02, *arguments)
    assert result.exit_code == 1
    assert [word for word in words if word not in " ".join(result.output.split())] == []


@needs_app("reference")
@pytest.mark.parametrize("method", ["newton", "gauss_seidel", "jacobi"])
def test_recorded_inputs_of_an_ssp_are_held_as_they_are(tmp_path: Path, method: str) -> None:
    """They are no smooth force: FMU and reference need the values of which the error is known."""
    ssp = tmp_path / "duffing.ssp"
    assert invoke("ssp", DUFFING, "-o", ssp, "--duration", 1.5).exit_code == 0
    result = invoke(
        "couple", ssp, "--stop", 1.5, "--method", method, "-o", tmp_path / "out.csv",
        "--report", tmp_path,
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    table = np.genfromtxt(tmp_path / "out.csv", delimiter=",", names=True, deletechars="")
    surrogate = slide.load(DUFFING)
    expected = surrogate.predict_newest(table["inputs.force"][:, None])[:-1, 0]
    assert table["surrogate.position"][1:] == pytest.approx(expected, abs=1e-5)


def test_connectors_of_the_system_are_its_inputs_and_outputs(
    halves: dict[str, Path], tmp_path: Path
) -> None:
    """In a table with semicolons and decimal commas; the same as with names of components."""
    ends = (
        '<Connection startConnector="ground" endElement="lower" endConnector="road"/>'
        '<Connection startElement="upper" startConnector="position" endConnector="height"/>'
    )
    structure = STRUCTURE.replace("</Connections>", f"{ends}</Connections>")
    path = write_car(tmp_path / "car.ssp", halves, structure)
    tables = []
    for name, text in (
        ("ground", "time;ground\n0;0,01\n1;0,02"),
        ("road", "time,lower.road\n0,0.01\n1,0.02"),
    ):
        inputs, output = tmp_path / f"{name}.csv", tmp_path / f"{name}_out.csv"
        inputs.write_text(text, encoding="utf-8")
        options = ("--inputs", inputs, "--moving", "lower", "-o", output, "--report", tmp_path)
        result = invoke("couple", path, "--step", 0.02, *options)
        assert result.exit_code == 0, result.output
        tables.append(np.genfromtxt(output, delimiter=",", names=True, deletechars=""))
    np.testing.assert_array_equal(tables[0], tables[1])
    np.testing.assert_array_equal(tables[0]["height"], tables[0]["upper.position"])
    assert np.ptp(tables[0]["height"]) > 0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t,lower.road\n0,0\n", ("columns ['t'", "expected time")),
        ("time,lower.road\n0,x\n", ("line 2", "expected 2 numbers")),
        ("time,lower.road,lower.road\n0,1,2\n", ("['lower.road'] more than once",)),
        ("time,lower.road\n", ("has 1 lines", "expected a header")),
        (f"time,lower.road\n0,{'1' * 200_000}\n", ("cannot be read",)),
        ("\ufefftime,lower.road\n0,x\n", ("line 2",)),  # the mark of Excel is no part of a name
    ],
)
def test_table_of_inputs_that_cannot_be_read_is_refused(
    car: Path, tmp_path: Path, text: str, words: tuple[str, ...]
) -> None:
    (tmp_path / "road.csv").write_text(text, encoding="utf-8")
    result = invoke("couple", car, "--step", 0.02, "--inputs", tmp_path / "road.csv")
    assert result.exit_code == 1
    assert [word for word in words if word not in " ".join(result.output.split())] == []


def test_step_is_the_one_that_an_fmu_names(car: Path, tmp_path: Path) -> None:
    result = invoke("couple", car, "--moving", "lower", "--report", tmp_path, "--json", "-")
    assert result.exit_code == 0, result.output
    assert '"step_s": 0.01' in result.output


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"../outside": b""}, "leaves the folder"),
        ({"SystemStructure.ssd": b" " * 20_000_001}, "expected at most 20000000"),
    ],
)
def test_hostile_ssp_is_refused_before_it_is_unpacked(
    tmp_path: Path, more: dict[str, bytes], said: str
) -> None:
    path = tmp_path / "bad.ssp"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in {"SystemStructure.ssd": STRUCTURE.encode(), **more}.items():
            archive.writestr(name, content)
    with refused(ValueError, "bad.ssp", said):
        read_ssp(path, tmp_path / "unpacked")
    assert not (tmp_path / "unpacked").exists()
