"""The FMI 2.0 calls of the native library: their order, references, messages and places; and what
both standards do alike."""

from __future__ import annotations

import ctypes
import re
import shutil
from pathlib import Path

import pytest

from slide_fmu.fmu.libraries.build import BINARIES
from slide_fmu.fmu.libraries.platforms import FmiVersion
from tests.fmu.native import DISCARD, ERROR, OK, ExportedFmu, Instance, Native
from tests.fmu.native3 import instance_of
from tests.fmu.standards import functions


def test_unknown_references_and_null_pointers_are_refused(rich: ExportedFmu) -> None:
    native = rich.instance().start()
    assert native.try_get(12)[0] == OK
    assert native.try_get(13)[0] == ERROR
    assert native.set(1.0, first=2) == ERROR
    assert "is no input" in native.messages[-1]
    assert native.set(1.0, first=4_000_000_000) == ERROR
    one = ctypes.c_size_t(1)
    assert native.call("fmi2GetReal", None, one, None) == ERROR
    assert native.call("fmi2SetReal", None, one, None) == ERROR
    assert native.call("fmi2GetReal", None, ctypes.c_size_t(0), None) == OK
    for kind in ("Integer", "Boolean", "String"):
        for verb in ("Get", "Set"):
            assert native.call(f"fmi2{verb}{kind}", None, one, None) == ERROR
            assert native.call(f"fmi2{verb}{kind}", None, ctypes.c_size_t(0), None) == OK
    for function in ("GetFMUstate", "SetFMUstate", "SerializedFMUstateSize"):
        assert native.call(f"fmi2{function}", None, None, None) == ERROR


def test_calls_in_the_wrong_state_are_refused(rich: ExportedFmu) -> None:
    native = rich.instance()
    assert native.do_step(0.0) == ERROR
    assert "instantiated" in native.messages[-1]
    assert native.call("fmi2ExitInitializationMode") == ERROR
    assert native.call("fmi2Terminate") == ERROR
    native.start()
    assert native.call("fmi2EnterInitializationMode") == ERROR
    assert native.call("fmi2Terminate") == OK
    assert native.do_step(0.0) == ERROR
    assert native.set(1.0) == ERROR
    assert native.try_get(2)[0] == OK


def test_all_functions_of_both_standards_are_exported(rich: ExportedFmu) -> None:
    windows = (BINARIES / "x86_64-windows" / "slide.dll").read_bytes()
    arm = (BINARIES / "aarch64-linux" / "slide.so").read_bytes()
    names = functions(2) + functions(3)
    assert len(functions(2)) > 40
    assert len(functions(3)) > 70
    for name in names:
        assert hasattr(rich.library, name)
        assert name.encode() + b"\0" in windows
        assert name.encode() + b"\0" in arm


@pytest.mark.parametrize("fmi", [2, 3])
def test_call_without_an_instance_is_an_error_and_no_crash(
    rich: ExportedFmu, fmi: FmiVersion
) -> None:
    for name in functions(fmi):
        if not re.search("Instantiate|FreeInstance|GetVersion|GetTypesPlatform", name):
            assert getattr(rich.library, name)(*[ctypes.c_void_p()] * 9) == ERROR, name
    getattr(rich.library, f"fmi{fmi}FreeInstance")(ctypes.c_void_p())


NOT_OFFERED = [
    *("fmi2GetRealOutputDerivatives", "fmi2CancelStep"),
    *("fmi2GetContinuousStates", "fmi2EnterEventMode"),
    *("fmi3EnterEventMode", "fmi3UpdateDiscreteStates", "fmi3EnterConfigurationMode"),
    *("fmi3GetVariableDependencies", "fmi3GetOutputDerivatives", "fmi3GetContinuousStates"),
    "fmi3ActivateModelPartition",
]


def test_functions_that_are_not_offered_answer_with_an_error(rich: ExportedFmu) -> None:
    two, three = rich.instance().start(), instance_of(rich).start()
    for name in NOT_OFFERED:
        native: Instance = two if name.startswith("fmi2") else three
        assert native.call(name, *[ctypes.c_void_p()] * 8) == ERROR
        assert native.messages[-1].startswith(name)


def test_statuses_that_are_not_known_are_discarded(rich: ExportedFmu) -> None:
    """Section 4.2.3 of the standard: an importer goes on."""
    native = rich.instance().start()
    value = ctypes.c_double()
    pending, last_successful_time, ended = 1, 2, 3
    for function, kind in (
        ("fmi2GetStatus", 0),
        ("fmi2GetStringStatus", pending),
        ("fmi2GetIntegerStatus", pending),
        ("fmi2GetRealStatus", ended),
        ("fmi2GetBooleanStatus", last_successful_time),
    ):
        assert native.call(function, kind, ctypes.byref(value)) == DISCARD
        assert native.messages[-1].startswith(function)
    assert native.do_step(0.0) == OK


def test_debug_logging_reports_calls_while_it_is_on_and_refuses_unknown_categories(
    rich: ExportedFmu,
) -> None:
    native = rich.instance()
    no_categories = (ctypes.c_size_t(0), None)
    native.start()
    assert native.messages == []
    assert native.call("fmi2SetDebugLogging", 1, *no_categories) == OK
    native.call("fmi2Terminate")
    assert native.messages == ["fmi2Terminate"]
    wrong = (ctypes.c_char_p * 1)(b"everything")
    assert native.call("fmi2SetDebugLogging", 1, ctypes.c_size_t(1), wrong) == ERROR


def test_instance_without_callbacks_reports_errors_without_a_crash(rich: ExportedFmu) -> None:
    library = rich.library
    library.fmi2Instantiate.restype = ctypes.c_void_p
    arguments = (b"one", 1, rich.guid.encode(), rich.uri.encode(), None, 0, 1)
    component = ctypes.c_void_p(library.fmi2Instantiate(*arguments))
    assert component.value
    assert library.fmi2DoStep(component, ctypes.c_double(0), ctypes.c_double(1), 0) == ERROR
    library.fmi2FreeInstance(component)


def test_resource_location_is_read_in_every_spelling_of_a_local_uri_and_refused_otherwise(
    rich: ExportedFmu, tmp_path: Path
) -> None:
    odd = tmp_path / "with space, % and ü"
    shutil.copytree(rich.folder / "resources", odd)
    path = str(rich.folder / "resources")
    for uri in (f"file:{path}", f"file://localhost{path}", f"FILE://{path}/", odd.as_uri()):
        assert rich.instance(uri=uri).component.value, uri
    for uri in (path, "", f"http://{path}", f"file://elsewhere{path}", "file:///%zz", "file:///%"):
        native = Native(rich.library, rich.guid, uri)
        assert not native.component.value
        assert len(native.messages) == 1
