"""Torch modules as FMUs: files, names, and what the subcommands for native FMUs say."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
import torch
from fmpy.fmi1 import FMICallException
from torch import nn

from slide_fmu.core.files import OLDEST
from slide_fmu.fmu.export import MODULE, FmuError, read_json
from slide_fmu.python_fmu.torch_export import ModuleError, export_module
from tests.cosim.damage import members_of, packed
from tests.fmu.samples import STEP
from tests.limits import largest_file
from tests.python_fmu.modules import (
    invoke,
    saved,
    script,
    small_description,
    start,
    surrogate_with,
)

DESCRIPTION = small_description("small", 1000.0, ("y",))


class Sum(nn.Module):
    """Gives the sum of its inputs, and fails where one is beyond the range."""

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        if window.abs().max() > 1.5:
            raise ValueError("too far")
        return window.sum(1)


@pytest.fixture
def module(tmp_path: Path) -> Path:
    path = tmp_path / "sum.pt"
    script(Sum(), path)
    (tmp_path / "signals.toml").write_text(DESCRIPTION, encoding="utf-8")
    return path


def exported(module: Path, path: Path, **changes: str) -> Path:
    """The FMU of a module; changes: of values in its description."""
    text = DESCRIPTION
    for key, value in changes.items():
        text = re.sub(f"^{key} = .*$", f"{key} = {value}", text, count=1, flags=re.MULTILINE)
    description = module.with_name("signals.toml")
    description.write_text(text, encoding="utf-8")
    return export_module(module, description, path)


def said(*arguments: object) -> str:
    """The one message of a subcommand that refuses; a traceback would be another exception."""
    result = invoke(*arguments)
    assert result.exit_code == 1
    assert isinstance(result.exception, SystemExit), result.exception
    return result.output


@pytest.mark.parametrize(
    "name", ["Path", "np", "json", "Clock", "partial", "Real", "int", "ModuleSlave", "match", "_"]
)
def test_names_hide_nothing(name: str, module: Path, tmp_path: Path) -> None:
    path = exported(module, tmp_path / "m.fmu", name=f'"{name}"')
    assert fmpy.read_model_description(str(path)).modelName == name
    slave = start(path, tmp_path / "a")
    slave.setReal([0], [500.0])
    slave.doStep(0.0, 0.01)
    assert slave.getReal([1_000_000]) == [2.0]
    slave.freeInstance()


@pytest.mark.parametrize("name", ["class", "None", "__name__", "1st", "größe", "", "a" * 101])
def test_name_that_no_class_can_have_is_refused(name: str, module: Path, tmp_path: Path) -> None:
    with pytest.raises(
        ModuleError, match=r"toml, line 1: name = .*: expected at most 100 letters"
    ):
        exported(module, tmp_path / "m.fmu", name=f'"{name}"')
    assert not (tmp_path / "m.fmu").exists()


def test_the_same_module_gives_the_same_bytes(module: Path, tmp_path: Path) -> None:
    paths = [exported(module, tmp_path / name) for name in ("a.fmu", "b.fmu")]
    assert paths[0].read_bytes() == paths[1].read_bytes()
    with zipfile.ZipFile(paths[0]) as archive:
        assert {info.date_time for info in archive.infolist()} == {OLDEST}
        assert b"generationDateAndTime" not in archive.read("modelDescription.xml")


def test_an_fmu_that_cannot_be_written_stays_as_it_was(module: Path, tmp_path: Path) -> None:
    path = exported(module, tmp_path / "m.fmu")
    before, files = path.read_bytes(), set(tmp_path.iterdir())
    with largest_file(len(before) // 2), pytest.raises(OSError, match="File too large"):
        exported(module, path)
    assert path.read_bytes() == before
    assert set(tmp_path.iterdir()) == files


def test_folder_is_no_place_for_an_fmu(module: Path, tmp_path: Path) -> None:
    folder = tmp_path / "d.fmu"
    folder.mkdir()
    about = ("--backend", "python", "--description", module.with_name("signals.toml"))
    assert f"'{folder}': is a folder; expected a file" in said(
        "export", module, *about, "-o", folder
    )
    assert list(folder.iterdir()) == []


def test_subcommand_for_native_fmus_refuses_one_that_carries_a_module(
    module: Path, tmp_path: Path
) -> None:
    path = exported(module, tmp_path / "m.fmu")
    for subcommand, *more in (
        ("check",),
        ("validate",),
        ("bench",),
        ("ssp", "-o", tmp_path / "m.ssp"),
        ("export", "-o", tmp_path / "again.fmu"),
    ):
        message = said(subcommand, path, *more)
        assert f"{path} carries a torch module; expected a native FMU" in message
        assert "slide-fmu" not in message


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"[1, 2]", "holds no JSON object"),
        (b'["ab"]', "holds no JSON object"),
        (b"null", "holds no JSON object"),
        (b'{"a": "\\ud800"}', "is no JSON"),
        (b'{"a": 1e999}', "is no JSON"),
        (b"{", "is no JSON"),
        (b'{"a": "\xff"}', "is no JSON"),
        (b"[" * 100_000, "is no JSON"),
    ],
)
def test_damaged_facts_of_a_module_are_refused(
    content: bytes, message: str, module: Path, tmp_path: Path
) -> None:
    path = exported(module, tmp_path / "m.fmu")
    path.write_bytes(packed({**members_of(path), MODULE: content}))
    assert f"{path}: {MODULE} {message}" in said("info", path)
    with pytest.raises(FmuError, match=message):
        read_json(path, MODULE)


def test_what_is_no_number_is_null(module: Path, tmp_path: Path) -> None:
    path = exported(module, tmp_path / "m.fmu")
    path.write_bytes(packed({**members_of(path), MODULE: b'{"a": [NaN, -Infinity, 1]}'}))
    assert read_json(path, MODULE) == {"a": [None, None, 1]}
    assert "NaN" not in invoke("info", path).output


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"low": "-1.7e308", "high": "1.7e308"},
            r"signal 'u': range \[-1.7e\+308, 1.7e\+308\] N; expected ends between -1e\+300 and",
        ),
        (
            {"low": "0.0", "high": "5e-324"},
            r"signal 'u': range \[0.0, 5e-324\] N.* offset and scale",
        ),
    ],
)
def test_range_that_cannot_be_scaled_is_refused(
    changes: dict[str, str], message: str, module: Path, tmp_path: Path
) -> None:
    with pytest.raises(ModuleError, match=rf"1st \[\[inputs\]\]: {message}"):
        exported(module, tmp_path / "m.fmu", **changes)


def test_description_in_another_encoding_is_refused(module: Path, tmp_path: Path) -> None:
    description = tmp_path / "latin.toml"
    description.write_bytes(DESCRIPTION.replace("small", "groß").encode("latin-1"))
    with pytest.raises(ModuleError, match=f"^{description}: not valid TOML: 'utf-8' codec"):
        export_module(module, description, tmp_path / "m.fmu")


def test_module_that_fails_before_the_first_step_is_reported(
    module: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    slave = start(exported(module, tmp_path / "m.fmu"), tmp_path / "a")
    slave.setReal([0], [5000.0])
    assert slave.getReal([0]) == [5000.0]
    assert np.isnan(slave.getReal([1_000_000])[0])
    assert "too far" in capfd.readouterr().out
    with pytest.raises(FMICallException):
        slave.doStep(0.0, 0.01)
    assert "refused because of what went before" in capfd.readouterr().out
    slave.setReal([0], [500.0])
    slave.doStep(0.0, 0.01)
    assert slave.getReal([1_000_000]) == [2.0]
    slave.freeInstance()


def test_no_step_ends_after_the_stop_time(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    files = saved(surrogate_with("zero_order"), tmp_path, ".pt")
    slave = start(export_module(*files, tmp_path / "m.fmu"), tmp_path / "a")
    slave.reset()
    slave.setupExperiment(startTime=0.0, stopTime=3 * STEP)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.doStep(0.0, STEP)
    data = slave.serializeFMUstate(slave.getFMUstate())
    for length in (2.001, 3, 40):
        with pytest.raises(FMICallException):
            slave.doStep(STEP, length * STEP)
        assert f"ends after the stop time {3 * STEP:.9g} s" in capfd.readouterr().out
    slave.setFMUstate(slave.deSerializeFMUstate(data))
    slave.doStep(STEP, 2 * STEP * (1 + 1e-9))
    with pytest.raises(FMICallException):
        slave.doStep(3 * STEP, STEP)
    slave.reset()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    for k in range(5):
        slave.doStep(k * STEP, STEP)
    slave.freeInstance()
