"""The wheel holds what it needs, and serves where there is no compiler, torch or exudyn."""

from __future__ import annotations

import importlib.metadata
import json
import os
import subprocess
import sys
import venv
import zipfile
from configparser import ConfigParser
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement

from slide_fmu.cosim.check import OUTPUT_TOLERANCE
from slide_fmu.fmu.export import read_fmu
from slide_fmu.fmu.libraries.build import LIBRARIES, STAMP
from tests.marks import APPS

ROOT = Path(__file__).parents[2]
DUFFING = ROOT / "fmus" / "duffing" / "duffing.fmu"
FORCE, STEPS = 200.0, 400

ABSENT = """
import importlib.util, json, shutil, sys
names = ["torch", "exudyn", "ziglang", "hatchling", "pip", "matplotlib", "pythonfmu"]
names += ["mbs_models"] + sys.argv[1:]
found = [name for name in names if importlib.util.find_spec(name)]
print(json.dumps(found + [c for c in ("cc", "gcc", "clang", "zig") if shutil.which(c)]))
"""
BASE_LACKS = ("fmpy", "scipy", "lxml", "cmake")
"""Packages of the extra "run"."""
PREDICT = """
import sys
import numpy as np
import slide_fmu
force, steps = float(sys.argv[2]), int(sys.argv[3])
print(slide_fmu.load(sys.argv[1]).predict_newest(np.full((steps, 1), force))[-1, 0])
"""
RUN = """
import json, sys
import fmpy

fmu, force, steps = sys.argv[1], float(sys.argv[2]), int(sys.argv[3])
result = fmpy.simulate_fmu(
    fmu, stop_time=steps * 0.03, output_interval=0.03, start_values={"force": force}
)
print(json.dumps([float(result[name][-1]) for name in ("position", "window_filled")]))
"""


def needed(
    requirements: list[str],
    distributions: dict[str, importlib.metadata.Distribution],
    extra: str = "",
) -> None:
    """Collect the packages that requirements ask for, with those that they need themselves."""
    for requirement in map(Requirement, requirements):
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": extra}):
            continue
        distribution = importlib.metadata.distribution(requirement.name)
        if distribution.metadata["Name"] not in distributions:
            distributions[distribution.metadata["Name"]] = distribution
            needed(distribution.requires or [], distributions)


def link(distribution: importlib.metadata.Distribution, site: Path) -> None:
    """Offer a package of this environment in another one."""
    for name in {file.parts[0] for file in distribution.files or ()}:
        source, place = Path(str(distribution.locate_file(name))), site / name
        if name != ".." and not name.endswith(".pth") and not place.exists():
            place.symlink_to(source)


class Environment:
    """An environment with the wheel and what it needs, and nothing else.

    The extra "run" is left out if the name of the extra is empty.
    """

    def __init__(self, folder: Path, wheel: Path, extra: str) -> None:
        venv.create(folder, with_pip=False)
        self.folder = folder
        (self.site,) = folder.glob("lib/python*/site-packages")
        pip = [
            Path(sys.base_prefix, "bin", "python3"),
            "-m",
            "pip",
            "--python",
            folder / "bin" / "python",
        ]
        install = ["install", "--quiet", "--no-index", "--no-deps", wheel]
        subprocess.run([*pip, *install], check=True, capture_output=True, cwd=folder)
        (wheel_info,) = self.site.glob("slide_fmu-*.dist-info")
        distributions: dict[str, importlib.metadata.Distribution] = {}
        needed(importlib.metadata.Distribution.at(wheel_info).requires or [], distributions, extra)
        for distribution in distributions.values():
            link(distribution, self.site)

    def call(self, program: str, *arguments: object) -> subprocess.CompletedProcess[str]:
        """Run one of its programs, which finds no others."""
        kept = {key: value for key, value in os.environ.items() if key.startswith("OMP_")}
        return subprocess.run(
            [self.folder / "bin" / program, *map(str, arguments)],
            env={**kept, "PATH": str(self.folder / "bin"), "HOME": str(self.folder)},
            cwd=self.folder,
            capture_output=True,
            text=True,
            check=False,
        )


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this working tree."""
    place = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(place)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (built,) = place.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """With the wheel and its extra "run"."""
    return Environment(tmp_path_factory.mktemp("environment"), wheel, "run")


def test_wheel_holds_the_compiled_runtime_and_no_models(wheel: Path) -> None:
    assert wheel.name.endswith("-py3-none-any.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert {
        "slide_fmu/fmu/runtime/source/resource.c",
        "slide_fmu/report/templates/report.html",
        "slide_fmu/report/web/report.js",
        "slide_fmu/core/web/modules/chart.js",
        "slide_fmu/report/templates/card.md",
        "slide_fmu/py.typed",
    } <= names
    folder = "slide_fmu/fmu/binaries/"
    binaries = {name.removeprefix(folder) for name in names if name.startswith(folder)}
    assert binaries == {*LIBRARIES, STAMP}
    tops = {name.split("/")[0] for name in names}
    assert tops == {"slide_fmu", *(t for t in tops if t.endswith(".dist-info"))}


def test_wheel_offers_every_app(wheel: Path) -> None:
    rows = ConfigParser()
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith("/entry_points.txt"))
        rows.read_string(archive.read(name).decode())
    apps = [path.parent.name for path in APPS.glob("*/__init__.py")]
    expected = {app: f"slide_fmu.apps.{app}.app:APP" for app in apps}
    assert dict(rows["slide_fmu.apps"]) == expected


@pytest.mark.extended
def test_environment_of_the_wheel_holds_its_dependencies_alone(environment: Environment) -> None:
    said = environment.call("python", "-c", ABSENT)
    assert json.loads(said.stdout) == [], said.stderr


@pytest.mark.extended
def test_wheel_without_extras_reads_evaluates_and_describes_an_fmu(
    wheel: Path, tmp_path: Path
) -> None:
    base = Environment(tmp_path / "base", wheel, "")
    said = base.call("python", "-c", ABSENT, *BASE_LACKS)
    assert json.loads(said.stdout) == [], said.stderr
    predicted = base.call("python", "-c", PREDICT, DUFFING, FORCE, STEPS)
    surrogate, _ = read_fmu(DUFFING)
    expected = surrogate.predict_newest(np.full((STEPS, 1), FORCE))[-1, 0]
    assert predicted.returncode == 0, predicted.stderr
    tolerance = OUTPUT_TOLERANCE * surrogate.output_scaling.scale[0]
    assert abs(float(predicted.stdout) - expected) < tolerance
    assert base.call("slide-fmu", "info", DUFFING).returncode == 0
    checked = base.call("slide-fmu", "check", DUFFING)
    assert checked.returncode == 1
    assert "'slide-fmu[run]'" in checked.stderr.replace("\n", " ")


@pytest.mark.extended
@pytest.mark.parametrize("fmi", [2, 3])
def test_installed_wheel_exports_checks_and_runs_an_fmu(
    environment: Environment, fmi: int
) -> None:
    fmu = environment.folder / f"duffing{fmi}.fmu"
    exported = environment.call("slide-fmu", "export", DUFFING, "--fmi", fmi, "-o", fmu)
    assert exported.returncode == 0, exported.stderr
    checked = environment.call("slide-fmu", "check", fmu)
    assert checked.returncode == 0, checked.stderr
    assert "no problems" in checked.stderr
    run = environment.call("python", "-c", RUN, fmu, FORCE, STEPS)
    assert run.returncode == 0, run.stderr
    surrogate, _ = read_fmu(DUFFING)
    expected = surrogate.predict_newest(np.full((STEPS, 1), FORCE))[-1, 0]
    position, filled = json.loads(run.stdout)
    assert filled == 1
    assert abs(position - expected) < OUTPUT_TOLERANCE * surrogate.output_scaling.scale[0]


@pytest.mark.extended
def test_fmu_exported_by_the_installed_wheel_has_the_same_bytes(
    environment: Environment, tmp_path: Path
) -> None:
    paths = [environment.folder / "there.fmu", tmp_path / "here.fmu"]
    there = environment.call("slide-fmu", "export", DUFFING, "-o", paths[0])
    assert there.returncode == 0, there.stderr
    here = [sys.executable, "-m", "slide_fmu", "export", DUFFING, "-o", paths[1]]
    subprocess.run(here, check=True, capture_output=True)
    assert paths[0].read_bytes() == paths[1].read_bytes()
