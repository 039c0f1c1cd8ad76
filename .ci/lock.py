"""Write the lock files anew: ``make lock`` calls this script where uv is installed.

``requirements.lock`` names every package that a checkout needs, with its version, the hashes of
its files and the machines that need it; ``.ci/requirements-cuda.lock`` those that torch needs
beside them where it came with CUDA, as on Linux from PyPI. Versions that are locked stay as they
are as long as ``pyproject.toml`` admits them; to get newer ones, remove theirs from the files.
``.ci/requirements-cpu.lock`` is written by hand, and held against them.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOCK = ROOT / "requirements.lock"
CPU_LOCK = ROOT / ".ci/requirements-cpu.lock"
CUDA_LOCK = ROOT / ".ci/requirements-cuda.lock"
PYTHONS = ("3.11", "3.12", "3.13")
PLATFORMS = ("x86_64-manylinux_2_28", "aarch64-manylinux_2_28")
"""For all of these the locked packages must have wheels."""
CUDA = re.compile(r"nvidia-|cuda-|triton==")
"""So begin the packages that torch needs for CUDA alone."""
BUILDS_EDITABLE = "editables"
"""The build backend asks for this, beside ``build-system.requires``, to install a checkout."""
HEADER = """\
# {about}
# make lock writes this file. Packages whose files have other hashes are not installed.
"""


def main() -> None:
    """Resolve all packages, write both files, and hold them against versions of Python."""
    blocks = blocks_of(_resolved())
    cuda = [block for block in blocks if CUDA.match(block)]
    others = [block for block in blocks if not CUDA.match(block)]
    _write(LOCK, "All packages of a checkout, without those of CUDA.", others)
    _write(CUDA_LOCK, "Packages that torch needs beside them where it came with CUDA.", cuda)
    for python in PYTHONS:
        for platform in PLATFORMS:
            _require_complete(python, platform)
            print(f"Python {python}, {platform}: all packages are there")
    _require_same_torch(*(path.read_text(encoding="utf-8") for path in (LOCK, CPU_LOCK)))


def blocks_of(text: str) -> list[str]:
    """Divide a lock file into one block for each package: requirement, hashes, who needs it."""
    return [block.strip() for block in re.split(r"^(?=\w)", text, flags=re.M)[1:]]


def without_hashes(text: str) -> str:
    """Return a lock file that names versions alone."""
    return re.sub(r" \\\n +--hash=\S+", "", text)


def torch_version(text: str) -> str:
    """Return the version of torch in a lock file, without its build."""
    (version,) = re.findall(r"^torch==([\d.]+)", text, flags=re.M)
    return str(version)


def _resolved() -> str:
    """Return what uv writes for the package with the extra ``dev``, and for what builds it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    build = [*project["build-system"]["requires"], BUILDS_EDITABLE]
    oldest = project["project"]["requires-python"].removeprefix(">=")
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "lock"
        # uv keeps the versions that its output names, and hashes, which are to be looked up anew
        kept = [path.read_text(encoding="utf-8") for path in (LOCK, CUDA_LOCK) if path.exists()]
        output.write_text(without_hashes("\n".join(kept)), encoding="utf-8")
        _uv(
            *("pip", "compile", "pyproject.toml", "-", "--extra", "dev"),
            *("--universal", "--python-version", oldest),
            *("--generate-hashes", "--no-header", "--output-file", str(output)),
            given="\n".join(build),
        )
        return output.read_text(encoding="utf-8")


def _require_complete(python: str, platform: str) -> None:
    """Let uv resolve the files for one kind of machine, by the metadata of their wheels alone.

    It refuses packages that the files do not name, and such as have no wheel of a known hash.
    """
    with tempfile.TemporaryDirectory() as target:
        _uv(
            *("pip", "install", "--dry-run", "--require-hashes", "--only-binary", ":all:"),
            *("--python-version", python, "--python-platform", platform, "--target", target),
            *("-r", str(LOCK), "-r", str(CUDA_LOCK)),
        )


def _uv(*arguments: str, given: str = "") -> None:
    command = [sys.executable, "-m", "uv", "--quiet", *arguments]
    if subprocess.run(command, cwd=ROOT, input=given, text=True).returncode:
        raise SystemExit(
            f"make lock: uv {' '.join(arguments)} failed; it says above what is wrong"
        )


def _require_same_torch(lock: str, cpu_lock: str) -> None:
    found, expected = torch_version(cpu_lock), torch_version(lock)
    if found != expected:
        raise SystemExit(
            f"{CPU_LOCK.name} has builds of torch {found}; expected {expected}, as in "
            f"{LOCK.name}: write the hashes of such builds there, which sha256sum prints"
        )


def _write(path: Path, about: str, blocks: list[str]) -> None:
    path.write_text("\n".join([HEADER.format(about=about), *blocks, ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
