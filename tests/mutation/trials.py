"""Copies of the repository, and how tests end in them."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]

BUILD = """
from slide_fmu.fmu.libraries import build
build.build_target(build.TARGETS["x86_64-linux/slide.so"])
(build.BINARIES / build.STAMP).write_text(build.digest())  # the other platforms are not run here
"""


@contextmanager
def copies(count: int) -> Iterator[list[Path]]:
    """Copies of the repository as it is here, with the compiled libraries."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, capture_output=True, check=True, text=True,
    ).stdout  # fmt: skip
    names = [name for name in listed.split("\0") if name and (ROOT / name).is_file()]
    names += [str(p.relative_to(ROOT)) for p in (ROOT / "slide_fmu/fmu/binaries").rglob("*.*")]
    with tempfile.TemporaryDirectory() as folder:
        places = [Path(folder) / f"copy {k}" for k in range(count)]
        for place in places:
            for name in names:
                (place / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / name, place / name)
        yield places


def outcome(place: Path, sources: Sequence[str], tests: Sequence[str], limit: float) -> str:
    """How tests end in a copy whose sources were changed.

    Args:
        place: the copy.
        sources: those that were changed; with one in C the library is compiled first.
        tests: files, or single tests as pytest names them, and options of pytest.
        limit: time in s that each command may take.

    Returns:
        "passed", "failed", "broken" where the sources do not compile or no test ran, or "hung".
    """
    # plugins of pytest take longer to load than many tests run, and none is needed here
    plain = {"PYTHONDONTWRITEBYTECODE": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    environment = {**os.environ, "PYTHONPATH": str(place), **plain}
    commands = [["-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]]
    if any(source.endswith(".c") for source in sources):
        commands.insert(0, ["-c", BUILD])
    try:
        for command in commands:
            status = subprocess.run(
                [sys.executable, *command], cwd=place, env=environment, timeout=limit,
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False,
            ).returncode  # fmt: skip
            if status != 0:
                return "failed" if status == 1 and "pytest" in command else "broken"
    except subprocess.TimeoutExpired:
        return "hung"
    return "passed"
