"""The sizes of fresh installations, in MB: ``python tests/benchmarks/install_sizes.py --json -``.

A wheel of this checkout is built, and installed with each extra into an environment of its own.
Given is the sum of all files in its ``site-packages``, without pip and setuptools, in units of
10^6 bytes, and the largest folders there.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import sysconfig
import tempfile
import venv
from pathlib import Path
from typing import Any

from figures_out import measure_and_write

from slide_fmu.core.progress import Stages

ROOT = Path(__file__).parents[2]
LARGEST = 4
"""Number of folders that are named."""
NOT_COUNTED = ("pip", "setuptools")


def size_of(path: Path) -> float:
    """Return the size of a file, or of all files in a folder, in MB."""
    files = [path] if path.is_file() else [file for file in path.rglob("*") if file.is_file()]
    return sum(file.stat().st_size for file in files) / 1e6


def installed(wheel: Path, extra: str, folder: Path) -> dict[str, Any]:
    """Install a wheel with an extra, "" for none, and return its sizes.

    Raises:
        subprocess.CalledProcessError: pip failed.
    """
    venv.create(folder, with_pip=True)
    wanted = f"{wheel}[{extra}]" if extra else str(wheel)
    pip = [folder / "bin" / "python", "-m", "pip", "install", "--quiet", wanted]
    subprocess.run(pip, check=True)
    packages = Path(sysconfig.get_path("purelib", "venv", {"base": str(folder)}))
    parts = {
        part.name: size_of(part)
        for part in packages.iterdir()
        if not part.name.startswith(NOT_COUNTED)
    }
    largest = sorted(parts.items(), key=lambda part: -part[1])[:LARGEST]
    return {
        "total_mb": round(sum(parts.values()), 1),
        "largest_mb": {name: round(size, 1) for name, size in largest},
    }


def sizes(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Return the sizes of the base installation and of the extras."""
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(place)]
        subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
        (wheel,) = place.glob("*.whl")
        return {
            extra or "base": installed(wheel, extra, place / f"with_{extra}")
            for extra in arguments.extras
        }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--extras", nargs="*", default=["", "run"], help="extras; '' is none")
    measure_and_write(parser, sizes)
