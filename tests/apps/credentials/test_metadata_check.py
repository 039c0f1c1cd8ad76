"""``check`` compares the metadata of an FMU with its provenance."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from slide_fmu.apps.credentials.members import METADATA
from slide_fmu.apps.credentials.metadata_check import metadata_problems
from slide_fmu.core.version import WRITTEN_BY, own_version
from slide_fmu.fmu.export import EXTRA, export_fmu, read_fmu, read_folder
from slide_fmu.pipeline.check import check
from tests.cosim.damage import members_of, packed
from tests.libraries import build_libraries

DUFFING = Path(__file__).parents[3] / "fmus" / "duffing" / "duffing.fmu"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (rb'relative_rmse="[^"]*"', b'relative_rmse="1e-9"'),
        (rb"relative RMSE [\d.]+ %", b"relative RMSE 0.01 %"),
    ],
)
def test_metadata_with_other_figures_than_the_provenance_is_a_problem(
    tmp_path: Path, old: bytes, new: bytes
) -> None:
    build_libraries()
    members = members_of(DUFFING)
    changed = re.sub(old, new, members[METADATA])
    assert changed != members[METADATA]
    path = tmp_path / "duffing.fmu"
    path.write_bytes(packed({**members, METADATA: changed}))
    problems = check(path, run=False).problems
    assert any(f"{METADATA} does not say what resources/provenance.json" in p for p in problems)


def test_metadata_of_another_version_may_have_other_words(tmp_path: Path) -> None:
    surrogate, found = read_fmu(DUFFING)
    name = METADATA.removeprefix(f"{EXTRA}/")
    extra = read_folder(DUFFING, EXTRA)
    extra[name] = extra[name].replace(b"relative RMSE", b"relative error")
    for version, count in ((own_version(), 1), ("0.9.0", 0)):
        path, origin = tmp_path / "duffing.fmu", {**(found or {}), WRITTEN_BY: version}
        export_fmu(surrogate, path, provenance=origin, extra=extra)
        problems = metadata_problems(path, surrogate, origin)
        assert min(len(problems), 1) == count
