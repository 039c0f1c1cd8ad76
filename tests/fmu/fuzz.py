"""Fuzz the C runtime: surrogate files, serialised states and sequences of calls of both standards.

    python -m tests.fmu.fuzz --minutes 60 --json -

Needs clang with libFuzzer (Debian: clang, libclang-rt-dev). The target (``c/fuzz``) is compiled
with the address and undefined-behaviour sanitizers and looks for more than crashes: every refusal
must come with a message, outputs must be finite, a step that is done again after going back must
give the same. An input names a small surrogate, edits of its file, and calls, of which some edit
serialised states; checksums are repaired, so that what lies behind them is reached. So inputs keep
their meaning when a layout changes.

What is found goes to ``build/fuzz/corpus``, where the next run goes on; ``--keep`` writes a
smallest set of inputs that reach the same code to ``tests/fmu/fuzz_corpus``, which a test replays.
Inputs that crash are named in the figures; run the program in ``build/fuzz`` on one of them.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from slide_fmu.fmu.libraries.build import BUILD
from tests.fmu.driver import build_program
from tests.fmu.small_shapes import FUZZED, small_surrogate

TARGET = Path(__file__).parent / "c" / "fuzz"
CORPUS = Path(__file__).parent / "fuzz_corpus"
FOLDER = BUILD.parent / "fuzz"
CHECKS = ["-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"]
DEBUG = ["-g", "-fno-omit-frame-pointer"]
DEFINES = {
    "resource": ["-Dslide_surrogate_open=slide_surrogate_on_disk"],
    "calls_life": ["-Dcalloc=fuzz_calloc"],
    "native": ["-Dcalloc=fuzz_calloc"],
    "state": ["-Dmemset=fuzz_memset"],
}
"""The target gives surrogates from memory, limits that of instances, and guards their arrays."""

LONGEST = 1024
"""Bytes of an input."""

SLOWEST = 10
"""Seconds that an input may take."""


class FuzzError(RuntimeError):
    """There is no compiler with libFuzzer, or it refused the sources."""


def write_samples(path: Path) -> Path:
    """Write the surrogates of the target as C arrays."""
    names = [f"sample_{index}" for index in range(len(FUZZED))]
    lines = ['#include "surrogate.h"']
    for name, shape in zip(names, FUZZED, strict=True):
        numbers = ",".join(map(str, small_surrogate(shape).to_bytes()))
        lines.append(f"static const unsigned char {name}[] = {{{numbers}}};")
    sizes = ", ".join(f"sizeof {name}" for name in names)
    lines.append(f"const unsigned char *const fuzz_samples[] = {{{', '.join(names)}}};")
    lines.append(f"const size_t fuzz_sample_sizes[] = {{{sizes}}};")
    lines.append(f"const size_t fuzz_n_samples = {len(names)};")
    path.write_text("\n".join(lines) + "\n")
    return path


def build_target(command: list[str], flags: list[str], folder: Path, replays: bool) -> Path:
    """Compile the target: with its own main program where it replays, else for libFuzzer.

    Args:
        command: the compiler.
        flags: its sanitizers, for compiling and linking.
        folder: for the program and the object files; made if it is not there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    sources = [path for path in sorted(TARGET.glob("*.c")) if replays or path.stem != "replay"]
    sources.append(write_samples(folder / "fuzz_samples.c"))
    included = [*flags, f"-I{TARGET}", "-include", str(TARGET / "guarded_arena.h")]
    return build_program(command, included, folder / "target", sources, DEFINES)


def libfuzzer() -> list[str]:
    """The compiler that has libFuzzer.

    Raises:
        FuzzError: there is none.
    """
    clang = shutil.which("clang")
    if clang is None:
        raise FuzzError(
            "no clang here; fuzzing needs it, with libFuzzer (Debian: apt-get install clang "
            "libclang-rt-dev)"
        )
    return [clang]


def fuzz(target: Path, seconds: int, seed: int) -> dict[str, object]:
    """Run the fuzzer on its corpus; it goes on after a crash.

    Returns:
        Figures: executions, inputs in the corpus, edges that they cover and edges that the
        compiler has made (of which many are the sanitizers' own, never to be reached), and paths
        of inputs that crashed.
    """
    corpus, found = FOLDER / "corpus", FOLDER / "found"
    for folder in (corpus, found, CORPUS):
        folder.mkdir(parents=True, exist_ok=True)
    options = [
        f"-max_total_time={seconds}",
        f"-max_len={LONGEST}",
        f"-timeout={SLOWEST}",
        f"-seed={seed}",
        "-fork=1",
        "-ignore_crashes=1",
        "-ignore_timeouts=1",
        "-ignore_ooms=1",
        f"-artifact_prefix={found}/",
    ]
    before = set(found.iterdir())
    command = [str(target), *options, str(corpus), str(CORPUS)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    covered, made = edges(target, [corpus, CORPUS])
    return {
        "seconds": seconds,
        "seed": seed,
        "executions": _last_number(r"^#(\d+): cov: ", result.stderr),
        "corpus": len(list(corpus.iterdir())),
        "edges_covered": covered,
        "edges_made": made,
        "crashes": sorted(str(path) for path in set(found.iterdir()) - before),
    }


def edges(target: Path, corpora: list[Path]) -> tuple[int, int]:
    """Edges that inputs cover, and edges that there are."""
    command = [str(target), "-runs=0", *map(str, corpora)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    covered = _last_number(r"^#\d+\s+DONE\s+cov: (\d+)", result.stderr)
    return covered, _last_number(r"PC tables \((\d+) PCs\)", result.stderr)


def _last_number(pattern: str, text: str) -> int:
    numbers = re.findall(pattern, text, re.MULTILINE)
    if not numbers:
        raise FuzzError(f"the fuzzer did not run:\n{text[-2000:]}")
    return int(numbers[-1])


def keep(target: Path) -> None:
    """Replace the kept corpus by a smallest set of all inputs that covers the same edges."""
    merged = FOLDER / "merged"
    shutil.rmtree(merged, ignore_errors=True)
    merged.mkdir(parents=True)
    options = ["-set_cover_merge=1", "-use_counters=0"]
    inputs = [str(FOLDER / "corpus"), str(CORPUS)]
    command = [str(target), *options, str(merged), *inputs]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise FuzzError(f"the corpus could not be made small:\n{result.stderr[-2000:]}")
    shutil.rmtree(CORPUS)
    shutil.copytree(merged, CORPUS)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help="write the kept corpus anew")
    parser.add_argument("--json", dest="place", default="-", help="file for the figures, or -")
    options = parser.parse_args(arguments)
    try:
        flags = [*CHECKS, *DEBUG, "-fsanitize=fuzzer"]
        target = build_target(libfuzzer(), flags, FOLDER, replays=False)
        figures = fuzz(target, round(60 * options.minutes), options.seed)
        if options.keep:
            keep(target)
    except FuzzError as error:
        print(error, file=sys.stderr)
        return 1
    text = json.dumps(figures, indent=2) + "\n"
    if options.place == "-":
        sys.stdout.write(text)
    else:
        Path(options.place).write_text(text, encoding="utf-8")
    return 1 if figures["crashes"] else 0


if __name__ == "__main__":
    sys.exit(main())
