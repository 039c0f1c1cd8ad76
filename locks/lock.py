"""Write the lock files anew: ``make lock``, which is ``python locks/lock.py`` where uv is installed.

``requirements.lock`` names every package that the checkout needs, with its version, the hashes of
its files and where it is needed; ``requirements-cuda.lock`` those that torch needs beside them
where it came with CUDA, as on Linux from PyPI. Versions that are locked stay as they are as long as
``pyproject.toml`` admits them: remove them from the files before to get newer ones. Builds of torch
for the CPU alone are not on PyPI; the hashes of known ones lie in ``locks/torch_cpu.sha256``.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOCK, CUDA_LOCK = ROOT / "requirements.lock", ROOT / "requirements-cuda.lock"
CPU_BUILDS = ROOT / "locks" / "torch_cpu.sha256"
PYTHONS = ("3.11", "3.12", "3.13")
"""Versions of Python for which the locked packages must have wheels, on Linux."""
CUDA = re.compile(r"(nvidia-|cuda-|triton==)")
"""Packages that torch needs with CUDA alone begin so."""
BUILDS_EDITABLE = "editables"
"""What the build backend asks for, beside ``build-system.requires``, where it installs a checkout."""
HEADER = """\
# {about}
# Written by make lock. Every package has the hashes of its files: pip installs no other.
"""


def main() -> None:
    """Resolve all packages, write both files, and hold them against the versions of Python."""
    both = blocks_of(_resolved())
    torch = next(version_of(block) for block in both if block.startswith("torch=="))
    hashes = cpu_hashes(CPU_BUILDS.read_text(encoding="utf-8"), torch)
    if not hashes:
        print(f"remark: {CPU_BUILDS} has no build of torch {torch}; where one is to be installed, "
              "write the line that sha256sum prints there", file=sys.stderr)
    both = [with_hashes(b, hashes) if b.startswith("torch==") else b for b in both]
    cuda = [block for block in both if CUDA.match(block)]
    _write(LOCK, "All packages of a checkout.", [b for b in both if b not in cuda])
    _write(CUDA_LOCK, "Packages that torch needs beside them where it came with CUDA.", cuda)
    for python in PYTHONS:
        _require_complete(python)


def blocks_of(text: str) -> list[str]:
    """Divide what uv writes into one block for each package: requirement, hashes, who needs it."""
    return [block.strip() for block in re.split(r"\n(?=\w)", text) if block.strip()]


def version_of(block: str) -> str:
    """Return the version that a block pins."""
    return re.split(r"[\s;]", block.split("==")[1])[0]


def cpu_hashes(listed: str, version: str) -> list[str]:
    """Return the hashes of the builds of this version for the CPU, from lines of sha256sum."""
    lines = (line.split() for line in listed.splitlines())
    return [found for found, name in lines if name.startswith(f"torch-{version}+cpu-")]


def with_hashes(block: str, hashes: list[str]) -> str:
    """Return a block with further hashes, which stand before those that it has."""
    first, rest = block.split("\n", 1)
    return "\n".join([first, *(f"    --hash=sha256:{found} \\" for found in hashes), rest])


def _resolved() -> str:
    """Return what uv writes for the package with all its extras, and for what builds it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    build = [*project["build-system"]["requires"], BUILDS_EDITABLE]
    oldest = project["project"]["requires-python"].removeprefix(">=")
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "lock"
        # uv keeps the versions that its output names
        kept = [path.read_text(encoding="utf-8") for path in (LOCK, CUDA_LOCK) if path.exists()]
        output.write_text("\n".join(kept), encoding="utf-8")
        _uv(
            *("pip", "compile", "pyproject.toml", "-", "--extra", "dev"),
            *("--universal", "--python-version", oldest),
            *("--generate-hashes", "--no-header", "--output-file", str(output)),
            given="\n".join(build),
        )
        return output.read_text(encoding="utf-8")


def _require_complete(python: str) -> None:
    """Let uv resolve the files for a version of Python, by the metadata of their wheels alone."""
    with tempfile.TemporaryDirectory() as target:
        _uv(
            *("pip", "install", "--dry-run", "--require-hashes", "--only-binary", ":all:"),
            *("--python-version", python, "--python-platform", "x86_64-manylinux_2_28"),
            *("--target", target, "-r", str(LOCK), "-r", str(CUDA_LOCK)),
        )
    print(f"Python {python}: all packages are there")


def _uv(*arguments: str, given: str = "") -> None:
    command = [sys.executable, "-m", "uv", "--quiet", *arguments]
    done = subprocess.run(command, cwd=ROOT, input=given, text=True)
    if done.returncode:
        raise SystemExit(f"make lock: uv {' '.join(arguments[:2])} failed, as it says above")


def _write(path: Path, about: str, blocks: list[str]) -> None:
    text = "\n".join([HEADER.format(about=about), *blocks, ""])
    path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
