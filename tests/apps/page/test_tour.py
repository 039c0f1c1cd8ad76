"""A page that moves by itself moves as its FMU can be trusted; visitors may try all else."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from slide_fmu.apps.page.facts import page_facts
from slide_fmu.core.figures import plain
from slide_fmu.fmu.export import read_fmu
from slide_fmu.fmu.libraries.build import BINARIES, PAGE_LIBRARY
from slide_fmu.pipeline.apps import example_run
from tests.libraries import build_libraries
from tests.limits import HANGS
from tests.node import node

RELEASED = sorted((Path(__file__).parents[3] / "fmus").glob("*/*.fmu"))
SECONDS = 60.0
TRUSTED = 0.98
MOVED = 0.1
"""A page that stands still would be trusted, too."""


@pytest.mark.parametrize("fmu", RELEASED, ids=lambda fmu: fmu.stem)
def test_page_that_moves_by_itself_for_a_minute_is_trusted(fmu: Path, tmp_path: Path) -> None:
    build_libraries()
    surrogate, provenance = read_fmu(fmu)
    run = example_run(fmu)
    assert run is not None
    parameters, files = run
    (tmp_path / "surrogate.slide").write_bytes(surrogate.to_bytes())
    facts = {**plain(page_facts(surrogate, provenance)), "trajectory": {"parameters": parameters}}
    task = {
        "runtime": str(BINARIES / PAGE_LIBRARY),
        "surrogate": str(tmp_path / "surrogate.slide"),
        "facts": facts,
        "files": {name: content.decode() for name, content in files.items()},
        "seconds": SECONDS,
    }
    (tmp_path / "task.json").write_text(json.dumps(task), encoding="utf-8")
    command = [node(), str(Path(__file__).with_name("run_tour.mjs")), str(tmp_path / "task.json")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=HANGS)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    print(f"{fmu.stem}: trusted {100 * found['trusted']:.1f} % of a minute")
    assert found["trusted"] >= TRUSTED
    assert found["moved"] >= MOVED
