"""What ``make setup`` installs: the packages of the lock files, and no others."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path
from types import ModuleType

import pytest
from packaging.markers import default_environment
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.limits import HANGS
from tests.refusals import refused

pytestmark = pytest.mark.extended

ROOT = Path(__file__).parents[2]
LOCKS = ("requirements.lock", ".ci/requirements-cuda.lock")
MACHINES = (
    {"sys_platform": "linux", "platform_machine": "x86_64"},
    {"sys_platform": "linux", "platform_machine": "aarch64"},
    {"sys_platform": "darwin", "platform_machine": "arm64"},
)

USUAL = {"checkout-1", "part-1", "ziglang-4"}
"""What a set-up of the small checkout installs in any case."""

needs_make = pytest.mark.skipif(shutil.which("make") is None, reason="needs make")


def load_script() -> ModuleType:
    """Return the script that writes the lock files, as a module."""
    spec = importlib.util.spec_from_file_location("lock", ROOT / ".ci" / "lock.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


LOCK = load_script()


def pinned(name: str) -> list[Requirement]:
    """Return the requirements of a lock file, without hashes."""
    text = LOCK.without_hashes((ROOT / name).read_text(encoding="utf-8"))
    return [Requirement(block.split("\n")[0]) for block in LOCK.blocks_of(text)]


@pytest.mark.parametrize("name", LOCKS)
def test_every_package_of_a_lock_file_has_one_version_and_hashes(name: str) -> None:
    blocks = LOCK.blocks_of((ROOT / name).read_text(encoding="utf-8"))
    assert blocks
    for block in blocks:
        assert "    --hash=sha256:" in block, block
    for requirement in pinned(name):
        assert [part.operator for part in requirement.specifier] == ["=="], requirement


@pytest.mark.parametrize("machine", MACHINES, ids=lambda m: f"{m['platform_machine']}")
@pytest.mark.parametrize("python", ["3.11.0", "3.11.9", "3.12.1", "3.13.0"])
def test_no_machine_is_asked_for_two_versions_of_a_package(
    python: str, machine: dict[str, str]
) -> None:
    there = {
        **machine,
        "python_full_version": python,
        "python_version": python.rpartition(".")[0],
    }
    both = pinned("requirements.lock") + pinned(".ci/requirements-cuda.lock")
    names = [r.name for r in both if r.marker is None or r.marker.evaluate(there)]
    assert len(names) == len(set(names))
    assert ("nvidia-cublas" in names) == (machine["sys_platform"] == "linux")


def test_lock_file_names_all_that_the_installed_packages_need() -> None:
    known = {
        requirement.name: requirement
        for requirement in pinned("requirements.lock")
        if requirement.marker is None or requirement.marker.evaluate()
    }
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    waiting = [Requirement("slide-fmu[dev]")]
    waiting += [Requirement(text) for text in project["build-system"]["requires"]]
    seen: set[str] = set()
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        if name != "slide-fmu":
            assert name in known, f"{name} is not in requirements.lock; expected it: make lock"
            version = str(next(iter(known[name].specifier))).removeprefix("==")
            assert requirement.specifier.contains(version), requirement
        if str(requirement) in seen:
            continue
        seen.add(str(requirement))
        environments = [
            {**default_environment(), "extra": extra} for extra in ("", *requirement.extras)
        ]
        for text in metadata.requires(requirement.name) or []:
            needed = Requirement(text)
            if needed.marker is None or any(map(needed.marker.evaluate, environments)):
                waiting.append(needed)
    assert len(seen) > 100


def test_locked_torch_has_the_hashes_of_its_builds_for_the_cpu_once() -> None:
    blocks = LOCK.blocks_of((ROOT / "requirements.lock").read_text(encoding="utf-8"))
    (torch,) = (block for block in blocks if block.startswith("torch=="))
    known = LOCK.CPU_BUILDS[torch.split()[0]]
    assert [torch.count(one) for one in known] == [1] * len(known)
    from_the_index = torch.replace(f"    --hash=sha256:{known[0]} \\\n", "")
    assert LOCK.with_cpu_builds(from_the_index) == torch


def test_torch_whose_builds_for_the_cpu_are_not_known_is_refused() -> None:
    with refused(SystemExit, "torch==2.2.0 is locked", "sha256sum"):
        LOCK.with_cpu_builds("torch==2.2.0 \\\n    --hash=sha256:12")
    assert LOCK.with_cpu_builds("a==1") == "a==1"


def test_blocks_of_a_lock_file_begin_where_a_package_does() -> None:
    text = "# about\n\na==1 \\\n    --hash=sha256:12 \\\n    --hash=sha256:34\n    # via b\nb==2\n"
    blocks = LOCK.blocks_of(text)
    assert [block.split("==")[0] for block in blocks] == ["a", "b"]
    assert LOCK.without_hashes(blocks[0]) == "a==1\n    # via b"


BACKEND = """
import zipfile

FILES = {
    "METADATA": "Metadata-Version: 2.1\\nName: checkout\\nVersion: 1\\n",
    "WHEEL": "Wheel-Version: 1.0\\nRoot-Is-Purelib: true\\nTag: py3-none-any\\n",
    "RECORD": "",
}

def build_editable(folder, settings=None, metadata=None):
    name = "checkout-1-py3-none-any.whl"
    with zipfile.ZipFile(f"{folder}/{name}", "w") as wheel:
        for file, text in FILES.items():
            wheel.writestr(f"checkout-1.dist-info/{file}", text)
    return name
"""
BUILD = """
from pathlib import Path

(Path(__file__).parent / "runtime").write_text("compiled")
"""
PROJECT = """
[build-system]
requires = []
build-backend = "backend"
backend-path = ["."]
[project]
name = "checkout"
version = "1"
"""


class Checkout:
    """A Checkout has the project's Makefile, and lock files of a few tiny packages.

    Its runtime, which the compiler ``ziglang`` would build, is one file.
    """

    def __init__(self, folder: Path, compiler: str = "") -> None:
        self.folder = folder / "a checkout"
        self.wheels = folder / "wheels"
        self.folder.mkdir()
        self.wheels.mkdir()
        (self.folder / ".ci").mkdir()
        shutil.copy(ROOT / "Makefile", self.folder)
        (self.folder / "backend.py").write_text(BACKEND, encoding="utf-8")
        (self.folder / "pyproject.toml").write_text(PROJECT, encoding="utf-8")
        build = self.folder / "slide_fmu/fmu/libraries/build.py"
        build.parent.mkdir(parents=True)
        build.write_text(compiler or BUILD, encoding="utf-8")
        self.part = self.wheel("part", "1")
        self.torch = self.wheel("torch", "2.0", "nvidia-x")
        self.lock_all()
        self.lock(".ci/requirements-cuda.lock", ("nvidia-x==3", self.wheel("nvidia-x", "3")))

    def lock_all(self) -> None:
        """Write the lock file of all packages, whose torch may also be one for the CPU."""
        zig = self.wheel("ziglang", "4")
        torch = [self.torch, *self.wheels.glob("torch-2.0+cpu*.whl")]
        self.lock(
            "requirements.lock",
            ("part==1", self.part),
            ("torch==2.0", *torch),
            ("ziglang==4", zig),
        )

    def wheel(self, name: str, version: str, needs: str | None = None) -> Path:
        """Write a wheel without modules."""
        stem = f"{name.replace('-', '_')}-{version}"
        about = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
        about += "" if needs is None else f"Requires-Dist: {needs}\n"
        path = self.wheels / f"{stem}-py3-none-any.whl"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr(f"{stem}.dist-info/METADATA", about)
            archive.writestr(
                f"{stem}.dist-info/WHEEL",
                "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
            )
            archive.writestr(f"{stem}.dist-info/RECORD", "")
        return path

    def lock(self, name: str, *packages: tuple[str | Path, ...]) -> None:
        """Write a lock file of packages and their wheels."""
        lines = []
        for package, *wheels in packages:
            sums = [hashlib.sha256(Path(wheel).read_bytes()).hexdigest() for wheel in wheels]
            hashes = " \\\n".join(f"    --hash=sha256:{one}" for one in sums)
            lines.append(f"{package} \\\n{hashes}\n")
        (self.folder / name).write_text("".join(lines), encoding="utf-8")

    def setup(self) -> subprocess.CompletedProcess[str]:
        """Call ``make setup`` with these wheels, without network, while .venv is activated.

        It has no pip; the Python that made it has.
        """
        activated = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        environment = {
            **os.environ,
            "PATH": activated,
            "PIP_NO_INDEX": "1",
            "PIP_FIND_LINKS": str(self.wheels),
            "PIP_CONFIG_FILE": os.devnull,
        }
        return subprocess.run(
            ["make", "setup"],
            cwd=self.folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=HANGS,
        )

    def installed(self) -> set[str]:
        """Return the names and versions of what was installed."""
        folders = (self.folder / ".venv").rglob("*.dist-info")
        return {folder.name.removesuffix(".dist-info") for folder in folders}


@needs_make
def test_setup_refuses_a_package_that_was_damaged(tmp_path: Path) -> None:
    checkout = Checkout(tmp_path)
    checkout.wheel("part", "1", "something")
    done = checkout.setup()
    assert done.returncode != 0
    assert "DO NOT MATCH THE HASHES" in done.stderr
    assert "part==1" in done.stderr
    assert not (checkout.folder / ".venv" / "ready").exists()


@needs_make
def test_setup_installs_what_torch_needs_for_cuda_where_it_came_with_it(tmp_path: Path) -> None:
    checkout = Checkout(tmp_path)
    done = checkout.setup()
    assert done.returncode == 0, done.stderr
    assert checkout.installed() == {*USUAL, "torch-2.0", "nvidia_x-3"}
    assert (checkout.folder / ".venv" / "ready").exists()
    assert (checkout.folder / "slide_fmu/fmu/libraries/runtime").exists()


@needs_make
def test_setup_takes_a_build_of_torch_for_the_cpu_where_there_is_one(tmp_path: Path) -> None:
    checkout = Checkout(tmp_path)
    checkout.wheel("torch", "2.0+cpu")
    checkout.lock_all()
    done = checkout.setup()
    assert done.returncode == 0, done.stderr
    assert checkout.installed() == {*USUAL, "torch-2.0+cpu"}


@needs_make
def test_setup_refuses_a_build_of_torch_for_the_cpu_that_is_not_locked(tmp_path: Path) -> None:
    checkout = Checkout(tmp_path)
    checkout.wheel("torch", "2.0+cpu")
    done = checkout.setup()
    assert done.returncode != 0
    assert "DO NOT MATCH THE HASHES" in done.stderr


@needs_make
def test_setup_fails_where_the_lock_files_miss_a_package(tmp_path: Path) -> None:
    checkout = Checkout(tmp_path)
    checkout.part = checkout.wheel("part", "1", "missing-one")
    checkout.lock_all()
    done = checkout.setup()
    assert done.returncode != 0
    assert "part 1 requires missing-one, which is not installed" in done.stdout
    assert not (checkout.folder / ".venv" / "ready").exists()


@needs_make
def test_setup_fails_where_the_runtime_cannot_be_compiled(tmp_path: Path) -> None:
    checkout = Checkout(tmp_path, "raise SystemExit('no such header')")
    done = checkout.setup()
    assert done.returncode != 0
    assert "no such header" in done.stderr
    assert not (checkout.folder / ".venv" / "ready").exists()
