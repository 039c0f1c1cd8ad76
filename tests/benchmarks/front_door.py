"""From a model to its FMU by the commands that a user types: time, lines typed, measured error.

    python tests/benchmarks/front_door.py --model quarter_car_function --json -

``slide-fmu init`` writes the recipe, nothing in it is edited, and ``slide-fmu run`` goes the whole
way by defaults. Errors are those of the report: relative RMSE of every output on trajectories with
seeds that no training saw, as FMU beside the reference. The folder of the run stays with
``--folder``.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from figures_out import measure_and_write

from slide_fmu.core.progress import Stages
from tests.own_models.quarter_car import build_in_c, build_in_python

ROOT = Path(__file__).parents[2]
TUTORIALS = ROOT / "docs" / "tutorials"
ROAD = ("--input", "road=-0.05..0.05")
HEATERS = ("--input", "left_heater=0..500", "--input", "right_heater=0..500")


@dataclass(frozen=True)
class Door:
    """A model, and what a user types about it.

    Attributes:
        file: name of the model's file; that of a model that ``init`` writes, as the README does.
        source: the file that is copied; None for one that is written or built here.
        options: what ``init`` is told.
    """

    file: str
    source: Path | None = None
    options: tuple[str, ...] = ()


def _tutorial(name: str, *options: str) -> Door:
    return Door(f"{name}.py", TUTORIALS / f"{name}.py", options)


DOORS = {
    "template": Door("template", None, ("--kind", "function")),
    "quarter_car_function": _tutorial("quarter_car_function", *ROAD),
    "quarter_car_exudyn": _tutorial("quarter_car_exudyn", *ROAD),
    "quarter_car_co_simulation": Door("quarter_car.fmu", None, ROAD),
    "quarter_car_model_exchange": Door("quarter_car.fmu", None, ROAD),
    "thermal_masses": _tutorial("thermal_masses_function", *HEATERS),
    "duffing_fmi_2": Door("duffing.fmu", ROOT / "fmus" / "duffing" / "duffing.fmu"),
    "duffing_fmi_3": Door("duffing.fmu"),
}


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Go through the door of one model."""
    del bar  # the commands show their own progress
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(arguments.folder or temporary)
        folder.mkdir(parents=True, exist_ok=True)
        return go_through(arguments.model, folder)


def go_through(model: str, folder: Path) -> dict[str, Any]:
    """Type the commands in a folder, and return what they took and what came out."""
    door, recipe = DOORS[model], f"{model}.toml"
    _lay(model, folder)
    begin, typed = time.monotonic(), []
    for words in (
        ("init", door.file, *door.options, "-o", recipe),
        ("run", recipe, "--json", "report.json"),
    ):
        typed.append(" ".join(["slide-fmu", *words]))
        subprocess.run([sys.executable, "-m", "slide_fmu", *words], cwd=folder, check=True)
    seconds = time.monotonic() - begin
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    outputs = report["validation"]["in range"]["outputs"]
    of_outputs = ("relative_rmse", "plain_relative_rmse")
    return {
        "model": model,
        "typed": typed,
        "minutes": seconds / 60,
        **{name: {o["name"]: o.get(name) for o in outputs} for name in of_outputs},
        "parameters": report["parameters"],
        "trajectories": report["learning_curve"]["points"][-1]["trajectories"],
        "sizes_tried": report["sizes_tried"],
        "remark": report["remark"],
    }


def _lay(model: str, folder: Path) -> None:
    """Lay the file of a model into a folder."""
    door = DOORS[model]
    place = folder / door.file
    if door.source is not None:
        shutil.copy(door.source, place)
    elif model == "template":
        return
    elif model == "quarter_car_co_simulation":
        build_in_python(place)
    elif model == "quarter_car_model_exchange":
        build_in_c(place)
    else:
        _in_fmi_3(DOORS["duffing_fmi_2"].source, place)


def _in_fmi_3(released: Path | None, place: Path) -> None:
    """Write the surrogate of a released FMU once more, for FMI 3.0."""
    import slide_fmu as slide

    assert released is not None
    slide.export_fmu(slide.load(released), place, fmi=3)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", choices=DOORS, default="quarter_car_function")
    parser.add_argument("--folder", help="where the work goes and stays; else it is removed")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
