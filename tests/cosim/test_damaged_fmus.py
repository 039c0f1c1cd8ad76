"""FMU files that are damaged: a message each, never a traceback."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from slide_fmu.cli.app import OF_APPS, SUBCOMMANDS, app
from slide_fmu.fmu.export import SURROGATE, export_fmu, read_fmu
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.importer.errors import FmuError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.cosim.damage import (
    Members,
    description_damages,
    members_of,
    named_damages,
    packed,
    random_damage,
)
from tests.fmu.samples import random_surrogate
from tests.fmu.small_shapes import SMALL
from tests.marks import first
from tests.refusals import refused

HARMLESS = {"metadata: description ''"}
"""What was as it is."""

SEEDS = 20
"""Random damages of an FMU of each standard."""
FEW = range(6)
"""Of them those that the subcommands that take longer are given."""

LINEAR = Path(__file__).parents[2] / "fmus" / "linear" / "linear.fmu"

both_standards = pytest.mark.parametrize("fmi", [2, 3])


def _members(folder: Path, fmi: FmiVersion) -> Members:
    surrogate = random_surrogate(SMALL)
    provenance: dict[str, object] = {"recipe": "sample", "errors": {"y0": 0.1}, "seed": 3}
    return members_of(export_fmu(surrogate, folder / "whole.fmu", fmi=fmi, provenance=provenance))


def _readers(folder: Path) -> dict[str, list[str]]:
    """Subcommands that read FMUs, with their options."""
    return {"check": [], "info": [], "export": ["-o", str(folder / "again.fmu")]}


def _runners(folder: Path) -> dict[str, list[str]]:
    """Subcommands that run FMUs, or pass them on to importers that do, with their options."""
    found = {
        "ssp": ["-o", str(folder / "beside.ssp"), "--duration", "1"],
        "validate": ["--trajectories", "1", "--duration", "10", "--report", str(folder)],
        "bench": ["--rounds", "1", "--steps", "1"],
    }
    installed = {function.__name__ for function in (*SUBCOMMANDS, *OF_APPS)}
    return {name: options for name, options in found.items() if name in installed}


def _refusals(
    path: Path, what: str, subcommands: dict[str, list[str]] | None = None
) -> dict[str, str]:
    """What subcommands, by default the readers, say when they refuse; nothing else may happen."""
    said = {}
    for subcommand, more in (subcommands or _readers(path.parent)).items():
        result = CliRunner().invoke(app, [subcommand, str(path), *more])
        refused = isinstance(result.exception, SystemExit)
        assert result.exception is None or refused, (what, subcommand, result.exception)
        assert result.output.strip(), (what, subcommand)
        if result.exit_code:
            said[subcommand] = result.output
    return said


def _check_all(folder: Path, damages: Iterable[tuple[str, bytes]]) -> None:
    path = folder / "damaged.fmu"
    for what, content in damages:
        path.write_bytes(content)
        said = _refusals(path, what)
        assert ("check" in said) == (what not in HARMLESS), (what, said)


@pytest.mark.extended
def test_damaged_archive_or_surrogate_is_refused_in_words(tmp_path: Path) -> None:
    _check_all(tmp_path, named_damages(_members(tmp_path, 2)))


@pytest.mark.parametrize("fmi", first([2, 3]))
def test_damaged_model_description_is_refused_in_words(tmp_path: Path, fmi: FmiVersion) -> None:
    _check_all(tmp_path, description_damages(_members(tmp_path, fmi)))


@pytest.mark.extended
@both_standards
def test_random_damage_is_refused_in_words_or_harmless(tmp_path: Path, fmi: FmiVersion) -> None:
    members, path = _members(tmp_path, fmi), tmp_path / "damaged.fmu"
    refused = 0
    for seed in range(SEEDS):
        path.write_bytes(random_damage(members, np.random.default_rng(seed)))
        refused += "check" in _refusals(path, f"seed {seed}")
    assert refused > 0.9 * SEEDS  # others are of dates and the like, which no reader looks at


@pytest.mark.extended
@both_standards
def test_subcommands_that_run_fmus_refuse_damaged_ones(tmp_path: Path, fmi: FmiVersion) -> None:
    """An FMU that comes as far: its recipe names a reference system."""
    surrogate, provenance = read_fmu(LINEAR)
    whole = export_fmu(surrogate, tmp_path / "whole.fmu", fmi=fmi, provenance=provenance)
    assert _refusals(whole, "whole", _runners(tmp_path)) == {}
    members, path = members_of(whole), tmp_path / "damaged.fmu"
    damages = [*description_damages(members)]
    damages += [(f"seed {k}", random_damage(members, np.random.default_rng(k))) for k in FEW]
    before, refused = list(sys.path), set()
    for what, content in damages:
        path.write_bytes(content)
        refused |= set(_refusals(path, what, _runners(tmp_path)))
        sys.path[:] = before  # PythonFMU leaves the folder of every instance there
    assert refused == set(_runners(tmp_path))


def test_subcommands_that_run_fmus_name_the_damaged_file(tmp_path: Path) -> None:
    members, path = members_of(LINEAR), tmp_path / "damaged.fmu"
    path.write_bytes(packed({**members, "modelDescription.xml": b"<"}))
    messages = _refusals(path, "no XML", _runners(tmp_path))
    assert set(messages) == set(_runners(tmp_path))
    for message in messages.values():
        assert f"{path} is not an FMU that can be read: " in message


def test_the_reader_raises_one_kind_of_error(tmp_path: Path) -> None:
    """From Python: FmuError, with the path."""
    path, said = tmp_path / "damaged.fmu", []
    for _, content in named_damages(_members(tmp_path, 2)):
        path.write_bytes(content)
        try:
            read_fmu(path)
        except FmuError as error:
            said.append(str(error))
    assert len(said) > 30
    assert all("damaged.fmu" in text for text in said)


def test_surrogate_longer_than_its_sections_is_refused_before_it_is_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Very many zeros take no place in an archive."""
    members, path = _members(tmp_path, 2), tmp_path / "damaged.fmu"
    payload = members[SURROGATE]
    path.write_bytes(packed({**members, SURROGATE: payload[:64] + bytes(30_000_000)}))

    def unpack(_: bytes) -> None:
        raise AssertionError("it was unpacked")

    monkeypatch.setattr(Surrogate, "from_bytes", unpack)
    with refused(FmuError, "damaged.fmu: surrogate file, near byte", "of 30000064"):
        read_fmu(path)
    monkeypatch.setattr("slide_fmu.fmu.export.LARGEST_SURROGATE", 1000)
    with refused(FmuError, "expected at most 1000", "30000064 bytes"):
        read_fmu(path)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("modelDescription.xml", b"<a/>", "modelDescription.xml begins with <a>"),
        ("modelDescription.xml", b"<", "modelDescription.xml is no XML"),
        ("/outside", b"", "leaves the folder of the archive"),
        ("resources/provenance.json", b"[" * 100_000, "provenance.json is no JSON"),
        ("resources/provenance.json", b'{"a": "\\ud800"}', "provenance.json is no JSON"),
    ],
)
def test_message_names_what_is_damaged(
    tmp_path: Path, name: str, content: bytes, message: str
) -> None:
    path = tmp_path / "damaged.fmu"
    path.write_bytes(packed({**_members(tmp_path, 2), name: content}))
    assert message in _refusals(path, name)["check"]
