"""Model descriptions that break the standard are refused by what is wrong in them."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.apps.couple.structure import coupled_system, default_step
from slide_fmu.importer import description
from slide_fmu.importer.errors import FmuError
from tests.own_models.strict_lag import build_strict_lag

FAULTS = {
    "no version": (' fmiVersion="2.0"', "", "no model description of FMI 2.0 or 3.0"),
    "no variables": (r"<ModelVariables>.*</ModelVariables>", "", "ModelVariables"),
    "no reference": (' valueReference="1"', "", "'valueReference' is required but missing"),
    "reference": ('valueReference="1"', 'valueReference="one"', "'one' is not a valid value"),
    "index": ('index="2"', 'index="7"', "refers to variables that it does not have"),
    "no guid": (r' guid="\{fine\}"', "", "guid is missing"),
    "no library": (' modelIdentifier="lag"', "", "modelIdentifier is missing for co_simulation"),
    "end": (' max="1"', ' max="one"', "max of 'drive' is 'one'; expected a number"),
    "start": (' start="0"', ' start="zero"', "start of 'drive' is 'zero'; expected a number"),
    "time": (' startTime="0.0"', ' startTime="x"', "startTime of the default experiment is 'x'"),
}


@pytest.fixture(scope="module")
def fine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_strict_lag(tmp_path_factory.mktemp("lag") / "fine.fmu")


def changed(fine: Path, path: Path, pattern: str, new: str) -> Path:
    """Write an FMU again, with another text at the first place of its model description."""
    with zipfile.ZipFile(fine) as old, zipfile.ZipFile(path, "w") as archive:
        for name in old.namelist():
            data = old.read(name)
            if name == "modelDescription.xml":
                text, count = re.subn(pattern, new, data.decode(), count=1, flags=re.DOTALL)
                assert count == 1
                data = text.encode()
            archive.writestr(name, data)
    return path


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_of_a_description_is_named_with_its_file(
    fine: Path, tmp_path: Path, fault: str
) -> None:
    pattern, new, said = FAULTS[fault]
    path = changed(fine, tmp_path / "broken.fmu", pattern, new)
    with pytest.raises(FmuError) as caught:
        slide.couple({"lag": path}, [], step=0.01, stop=0.1)
    assert "broken.fmu" in str(caught.value)
    assert said in str(caught.value)


def test_harmless_faults_do_not_keep_an_fmu_from_running(fine: Path, tmp_path: Path) -> None:
    path = changed(fine, tmp_path / "a.fmu", 'stepSize="0.01"', 'stepSize="-1" tolerance="x"')
    path = changed(path, tmp_path / "b.fmu", "<Real start", '<Real unit="unknown" start')
    drive = {"lag.drive": (np.array([0.0, 1.0]), np.array([0.0, 1.0]))}
    run = slide.couple({"lag": path}, [], step=0.01, stop=0.1, inputs=drive)
    assert run["lag.level"][-1] > 0.01
    with pytest.raises(ValueError, match="no FMU names a step"):
        default_step(coupled_system({"lag": path}, [], {}, {}))


def test_type_of_what_cannot_be_connected_is_named(fine: Path, tmp_path: Path) -> None:
    real = '<Real start="0" min="-1" max="1"/>'
    path = changed(fine, tmp_path / "whole.fmu", real, '<Integer start="0"/>')
    with pytest.raises(ValueError, match="no input 'drive', which is of type Integer and caus"):
        slide.couple({"a": fine, "b": path}, [("a.level", "b.drive")], step=0.01, stop=0.1)


def test_description_that_fills_the_memory_is_not_read(
    fine: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(description, "MOST_BYTES", 2000)
    path = changed(fine, tmp_path / "large.fmu", "$", " " * 2000)
    with pytest.raises(FmuError, match=r"modelDescription\.xml has \d+ bytes; expected at most"):
        slide.couple({"lag": path}, [], step=0.01, stop=0.1)
