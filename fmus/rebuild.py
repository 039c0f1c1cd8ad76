"""Build released FMUs again without training: ``python fmus/rebuild.py fmus/duffing/duffing.fmu``.

Each FMU is replaced by one with the same surrogate, provenance, measured figures and report, and
with the runtime of this version; its card is written again too. To train and to measure again:
``make release NAME=duffing``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from slide_fmu.pipeline.rebuild import rebuild


def main() -> None:
    """Run the command line: build the named FMUs again and print how large they were and are."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("fmus", nargs="+", type=Path, help="released FMUs")
    for path in parser.parse_args().fmus:
        before = path.stat().st_size
        after = rebuild(path).stat().st_size
        print(f"{path}: {before} bytes before, {after} now, {100 * after / before:.0f} %")


if __name__ == "__main__":
    main()
