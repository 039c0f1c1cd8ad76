"""Write the lock files anew: ``make lock`` calls this script where uv is installed.

``requirements.lock`` names every package that a checkout needs, with its version, the hashes of
its files and the machines that need it; ``.ci/requirements-cuda.lock`` those that torch needs
beside them where it came with CUDA, as on Linux from PyPI. Versions that are locked stay as they
are as long as ``pyproject.toml`` admits them; to get newer ones, remove theirs from the files.
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
CUDA_LOCK = ROOT / ".ci/requirements-cuda.lock"
PYTHONS = ("3.11", "3.12", "3.13")
PLATFORMS = ("x86_64-manylinux_2_28", "aarch64-manylinux_2_28")
"""For all of these the locked packages must have wheels."""
CUDA = re.compile(r"nvidia-|cuda-|triton==")
"""So begin the packages that torch needs for CUDA alone."""
CPU_BUILDS = {  # cp311, manylinux_2_28, x86_64
    "torch==2.13.0": ["6746dbcbeb526eb61330b76b41ff1b4eb848951103a892eeb080dfa2b264667b"],
}
"""SHA-256 of builds of torch for the CPU alone, which ``make setup`` takes where pip finds one.
They are not on PyPI, so uv does not know them: ``sha256sum`` prints what belongs here."""
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
    others = [with_cpu_builds(block) for block in blocks if not CUDA.match(block)]
    _write(LOCK, "All packages of a checkout, without those of CUDA.", others)
    _write(CUDA_LOCK, "Packages that torch needs beside them where it came with CUDA.", cuda)
    for python in PYTHONS:
        for platform in PLATFORMS:
            _require_complete(python, platform)
            print(f"Python {python}, {platform}: all packages are there")


def blocks_of(text: str) -> list[str]:
    """Divide a lock file into one block for each package: requirement, hashes, who needs it."""
    return [block.strip() for block in re.split(r"^(?=\w)", text, flags=re.M)[1:]]


def without_hashes(text: str) -> str:
    """Return a lock file that names versions alone."""
    return re.sub(r" \\\n +--hash=\S+", "", text)


def with_cpu_builds(block: str) -> str:
    """Return the block of torch with the hashes of builds for the CPU alone, any other as it is.

    Raises:
        SystemExit: no such hashes are known of the version that is locked.
    """
    requirement = block.split()[0]
    if not requirement.startswith("torch=="):
        return block
    if requirement not in CPU_BUILDS:
        raise SystemExit(
            f"{requirement} is locked; expected one of {', '.join(CPU_BUILDS)}, whose builds for "
            "the CPU are known: add the hashes that sha256sum prints to CPU_BUILDS"
        )
    hashes = "".join(f"    --hash=sha256:{one} \\\n" for one in CPU_BUILDS[requirement])
    return block.replace(" \\\n", f" \\\n{hashes}", 1)


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


def _write(path: Path, about: str, blocks: list[str]) -> None:
    path.write_text("\n".join([HEADER.format(about=about), *blocks, ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
