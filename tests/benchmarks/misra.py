"""What cppcheck's MISRA add-on finds in the scalar sources of an FMU: how often, by rule.

    python tests/benchmarks/misra.py fmus/duffing/duffing.fmu --json -

Rules are those of MISRA C:2012 that the add-on knows, by number; their texts may not be copied.
Files of the FMI project and of the C library are not counted. ``others`` are what cppcheck says
besides.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

from figures_out import measure_and_write
from source_case import open_case

from slide_fmu.core.progress import Stages

RULE = re.compile(r"misra-c2012-(\d+\.\d+)$")
CHECK = ("--addon=misra", "--std=c99", "--platform=unix32", "--quiet", "-j2", "-I.")
TEMPLATE = "--template={file} {line} {id}"
LEVELS = "--enable=style,warning,portability"


def findings(sources: Path) -> set[tuple[str, str, str]]:
    """File, line and identifier of all that is found, each once.

    Raises:
        RuntimeError: cppcheck failed.
    """
    files = sorted(path.name for path in sources.glob("*.c"))
    command = ["cppcheck", *CHECK, LEVELS, TEMPLATE, *files]
    done = subprocess.run(command, cwd=sources, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stdout + done.stderr)
    lines = (line.split() for line in done.stderr.splitlines())
    return {(w[0], w[1], w[2]) for w in lines if len(w) == 3 and not w[0].startswith("fmi2F")}


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Numbers of findings by rule, and what else is found."""
    show = bar("cppcheck")
    show(0, 1)
    with tempfile.TemporaryDirectory() as name:
        found = findings(open_case(arguments.fmu, Path(name), "scalar").sources)
    show(1, 1)
    rules = Counter(match[1] for *_, what in found if (match := RULE.match(what)))
    others = sorted(" ".join(finding) for finding in found if not RULE.match(finding[2]))
    by_number = sorted(rules.items(), key=lambda item: [int(part) for part in item[0].split(".")])
    return {"rules": dict(by_number), "others": others}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmu", type=Path)
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
