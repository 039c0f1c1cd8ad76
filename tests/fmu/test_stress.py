"""Many threads, many lives, many steps: the released FMUs and small ones, from a C program."""

from __future__ import annotations

import subprocess
from pathlib import Path

import fmpy
import pytest

from slide_fmu.fmu.description.fmi2 import guid_of
from slide_fmu.fmu.export import export_fmu, read_fmu
from slide_fmu.fmu.libraries.build import WARNINGS, include_flags
from tests.fmu.driver import build_program, host_compilers, required_sanitizer, run_compiler
from tests.fmu.native import ExportedFmu, Load
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate
from tests.fmu.small_shapes import CELLS, DIRECTOR, GATED, SMALL

pytestmark = pytest.mark.extended

SOURCE = Path(__file__).parent / "c" / "stress.c"
RELEASED = sorted((Path(__file__).parents[2] / "fmus").glob("*/*.fmu"))
SHAPES = {"layers": SMALL, "cells": CELLS, "gated": GATED, "director": DIRECTOR}
# What the estimates average, and the window of cells, divide the period of the input (stress.c):
# sums over a ring begin where they began, and cells hand over where they did.
LAYERS = Shape(n_in=8, n_out=4, hidden=(4,), positions=4)
CELL = Shape(n_in=10, n_out=4, hidden=(4,), positions=4, cell=CellShape(4, 8))

LIVES = 10_000
STEPS = 10_000_000

ALLOWED_GROWTH = 1 << 20
"""Bytes of resident memory, of 9000 lives: a leak of 120 bytes in each would be more."""

INSTRUMENTED = ["-fsanitize=thread", "-g"]


def _unpacked(fmu: Path, folder: Path) -> ExportedFmu:
    surrogate, _ = read_fmu(fmu)
    return ExportedFmu(surrogate, fmu, Path(fmpy.extract(str(fmu), str(folder))))


def _linked(loaded: ExportedFmu, folder: Path) -> Path:
    """The program with the FMU's own library."""
    program, library = folder / "stress", loaded.folder / "binaries" / fmpy.platform
    command, _ = host_compilers()[-1]
    arguments = [*WARNINGS, "-D_POSIX_C_SOURCE=200809L", "-O2", *include_flags(), str(SOURCE)]
    linked = [str(next(library.glob("*.so"))), "-lm", "-lpthread", "-o", str(program)]
    built = run_compiler(command, [*arguments, *linked])
    assert built.returncode == 0, built.stderr
    return program


def _run(program: Path, verb: str, loaded: ExportedFmu, count: int) -> list[str]:
    surrogate = loaded.surrogate
    n_outputs = len(surrogate.outputs)
    values = n_outputs * (1 if surrogate.estimator is None else 2)
    scale = max(max(abs(signal.low), abs(signal.high)) for signal in surrogate.inputs)
    sizes = surrogate.window.step, scale, len(surrogate.inputs), n_outputs, values, count
    task = loaded.folder / "resources", guid_of(surrogate.to_bytes()), *sizes
    result = subprocess.run(
        [program, verb, *map(str, task)], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout.split()


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_instances_in_eight_c_threads_give_what_one_gives(
    load: Load, tmp_path: Path, shape: Shape
) -> None:
    loaded = load(random_surrogate(shape))
    assert _run(_linked(loaded, tmp_path), "threads", loaded, 2000) == ["same"]


@pytest.mark.parametrize("fmu", RELEASED, ids=lambda path: path.stem)
def test_released_fmus_in_eight_c_threads_give_what_one_gives(fmu: Path, tmp_path: Path) -> None:
    loaded = _unpacked(fmu, tmp_path / "fmu")
    assert _run(_linked(loaded, tmp_path), "threads", loaded, 300) == ["same"]


def test_thread_sanitizer_finds_no_race_between_instances(load: Load, tmp_path: Path) -> None:
    """Under the thread sanitizer."""
    compiler = required_sanitizer(tmp_path, INSTRUMENTED)
    folder = tmp_path / "instrumented"
    folder.mkdir()
    program = build_program(*compiler, folder / "stress", [SOURCE], {})
    for index, shape in enumerate((SMALL, CELLS)):
        (tmp_path / str(index)).mkdir()
        path = export_fmu(random_surrogate(shape), tmp_path / str(index) / "sample.fmu")
        loaded = _unpacked(path, tmp_path / str(index) / "fmu")
        assert _run(program, "threads", loaded, 100) == ["same"]


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_ten_thousand_instances_after_each_other_leave_no_memory_behind(
    load: Load, tmp_path: Path, shape: Shape
) -> None:
    loaded = load(random_surrogate(shape))
    grown = int(_run(_linked(loaded, tmp_path), "lives", loaded, LIVES)[0])
    assert grown < ALLOWED_GROWTH


def test_ten_thousand_instances_of_a_released_fmu_leave_no_memory_behind(tmp_path: Path) -> None:
    linear = next(path for path in RELEASED if path.stem == "linear")
    loaded = _unpacked(linear, tmp_path / "fmu")
    grown = int(_run(_linked(loaded, tmp_path), "lives", loaded, LIVES)[0])
    assert grown < ALLOWED_GROWTH


@pytest.mark.parametrize("shape", [LAYERS, CELL], ids=["layers", "cells"])
def test_ten_million_steps_keep_time_and_results(load: Load, tmp_path: Path, shape: Shape) -> None:
    """The time is that of all steps, and a periodic input gives what it gave at the start."""
    loaded = load(random_surrogate(shape))
    time, differing = _run(_linked(loaded, tmp_path), "long", loaded, STEPS)
    assert float(time) == STEPS * STEP
    assert int(differing) == 0
