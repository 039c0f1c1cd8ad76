"""The subcommands on recipes read their options and print the results.

The work is in ``pipeline``, or in the room of its name, and is imported when the subcommand is
called. So exporting an FMU does not wait for imports that train networks or draw figures.
"""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Annotated, Literal

import typer

from slide_fmu.cli.console import (
    GOES_ON,
    console,
    errors,
    json_bytes,
    progress_bars,
    show_remark,
    write_json,
)
from slide_fmu.cli.options import (
    DataSeedOption,
    ExecutorOption,
    InputsOption,
    JsonOption,
    QuickOption,
    RecipeArgument,
    RunsOption,
    ThreadsOption,
    TrainingSeedOption,
    TrajectoriesOption,
    WorkersOption,
)
from slide_fmu.cli.stage_results import (
    show_draft,
    show_resolved,
    show_sizing,
    show_trial,
)
from slide_fmu.core.extras import how_to_install, missing_for_training, require_training
from slide_fmu.core.file_kinds import record_formats
from slide_fmu.validation.task import UNSEEN_SEED


def init(
    models: Annotated[
        list[str],
        typer.Argument(
            metavar="MODEL...",
            help="The model: an FMU, a Python file, package.module:Class, or one or more"
            f" records ({record_formats()}). If there is no such model, --kind "
            "writes a new one with this name.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--recipe", help="Write the recipe to this file. Default: NAME.toml."),
    ] = None,
    inputs: Annotated[
        list[str] | None,
        typer.Option(
            "--input",
            metavar="NAME=LOW..HIGH",
            help="Name and range of an input; repeat it for each one. For an FMU: the "
            "inputs that you do not name keep their start values; name none to take"
            " all. For a record: name every input; --input NAME takes the measured "
            "range.",
        ),
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option(
            "--output",
            metavar="NAME",
            help="Name of an output; repeat it for each one. Default: all outputs, or "
            "all columns of a record that are no inputs.",
        ),
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            help="Kind of the model: class, exudyn, fmu, function or record. Default: "
            "what its name says."
        ),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(
            help="Sample step in s. Default: found by simulation, or the step of the "
            "record. A record without times needs it."
        ),
    ] = None,
    hold: Annotated[
        Literal["zero_order", "first_order"] | None,
        typer.Option(
            help="How inputs act between samples: zero_order (held over a step) or "
            "first_order (they move). Default: what the model says; otherwise "
            "inputs of functions and FMUs move, and of exudyn models those in m, "
            "mm, rad or deg.",
        ),
    ] = None,
    fmu_step: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            help="Step in s by which you run your co-simulation FMU. Its inputs are held"
            " over this step, so they are late by half of it. Default: they move "
            "smoothly.",
        ),
    ] = None,
    time: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Column of a record with its times. Default: found by its name. none, "
            "together with --step, ignores the times: samples have equal distances.",
        ),
    ] = None,
    read: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE",
            help="How the files of a record are read, as missing=-9999 or fill=1; repeat it for "
            "each key. The page on records lists the keys.",
        ),
    ] = None,
    chain: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="URDF of a robot whose joint set points are the inputs. Default: the "
            "URDF next to the model, if there is only one and it fits.",
        ),
    ] = None,
    loops: Annotated[
        list[str] | None,
        typer.Option(
            "--loop",
            metavar="OUTPUT:INPUT",
            help="An output that decides an input through another part, such as the force on a "
            "body and its position; repeat it for each one. Motions in such loops are learnt "
            "too.",
        ),
    ] = None,
    jumps: Annotated[
        bool | None,
        typer.Option(
            "--jumps/--no-jumps",
            help="Inputs that move also jump, at any time, as with switches, valves and emergency "
            "stops: the model and the error bound see such jumps. Inputs that are constant over "
            "each step of the importer are better with --hold zero_order. Default: forces, flows "
            "and the like jump; lengths and angles, and inputs of classes do not.",
        ),
    ] = None,
    inputs_file: InputsOption = None,
    bands: Annotated[
        list[str] | None,
        typer.Option(
            "--band",
            metavar="[NAME=]LOW..HIGH",
            help="Lowest and highest frequency in Hz at which the machine works, as in 10..25: a "
            "quarter of the motions are sines in this band, up to the whole range, and the step "
            "follows from it. Repeat it with the names of inputs that have bands of their own, as "
            "in torque=5..20. Default: sines of all frequencies.",
        ),
    ] = None,
    name: Annotated[str | None, typer.Option(help="Name of the recipe and of the FMU.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that exist.")] = False,
) -> None:
    """Write a first recipe for your own model, and list what was found and assumed."""
    from slide_fmu.propose.draft_signals import parse_bands, parse_keys, parse_range, proposed_name
    from slide_fmu.propose.first_recipe import write_first_recipe
    from slide_fmu.propose.proposal import InitOptions

    with progress_bars() as bar:
        place = output or Path(f"{proposed_name(models[0], name)}.toml")
        folder = output.parent if output is not None else Path()
        options = InitOptions(
            model=models[0],
            inputs=parse_range(inputs or []),
            outputs=tuple(outputs or ()),
            kind=kind,
            step=step,
            name=name,
            folder=folder,
            chain=chain,
            hold=hold,
            fmu_step=fmu_step,
            further=tuple(models[1:]),
            time=time,
            read=parse_keys(read or []),
            loops=tuple(loops or ()),
            jumps=jumps,
            inputs_file=inputs_file,
            bands=parse_bands(bands or []),
        )
        proposal = write_first_recipe(options, place, force, bar, console.print)
    show_draft(proposal)
    console.print(f"recipe  {place}")
    if missing_for_training() is not None:
        console.print(f"install {how_to_install('train')}: try and run need it")
    console.print(f"next    slide-fmu try {quote(str(place))}")


def try_(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the motions.")] = None,
    runs: RunsOption = Path("runs"),
) -> None:
    """Check in half a minute whether a recipe fits the model, and what its data will cost."""
    with errors():
        require_training()
    from slide_fmu.memory.sizing import require_window
    from slide_fmu.propose.trial import open_trial, try_recipe

    with progress_bars() as bar:
        progress = bar("trial")
        job = open_trial(recipe, runs, progress)
        trial = try_recipe(job, progress, seed)
    show_trial(trial.figures(), None if job.recipe.window.allow_short else trial.sizing.problem)
    write_json(json_path, trial.figures())
    with errors():
        require_window(job.recipe, trial.sizing)
    console.print(f"next    slide-fmu run {quote(str(recipe))}")


def run(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: TrainingSeedOption = None,
    data_seed: DataSeedOption = None,
    trajectories: TrajectoriesOption = None,
    runs: RunsOption = Path("runs"),
    workers: WorkersOption = None,
    threads: ThreadsOption = 1,
    inputs_file: InputsOption = None,
    quick: QuickOption = False,
) -> None:
    """Do everything: find the window, make data, train, write the FMU, measure it."""
    with errors():
        require_training()
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.run import run_recipe
    from slide_fmu.report.console import print_curve, print_sizes
    from slide_fmu.report.quality import require_quality

    with progress_bars(GOES_ON) as bar:
        seeds = seed, data_seed
        job = open_job(
            recipe, runs, bar, *seeds, inputs_file=inputs_file, quick=quick, tell=console.print
        )
        show_resolved(job.resolved)
        finished = run_recipe(job, UNSEEN_SEED, trajectories, workers, threads)
    figures = finished.figures
    print_curve(figures.learning_curve, console)
    print_sizes(figures.sizes_tried, figures.explanations, console)
    for remark in (figures.remark, *(figures.record_remarks or ())):
        show_remark(remark)
    write_json(json_path, figures.dump())
    for sentence in finished.verdict:
        console.print(sentence)
    console.print(f"FMU     {finished.fmu}\nreport  {finished.page}")
    console.print(f"next    slide-fmu info {quote(str(finished.fmu))}")
    with errors():
        require_quality(job.recipe, figures)


def window(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the motions.")] = None,
    runs: RunsOption = Path("runs"),
) -> None:
    """Measure how long a system remembers its past, and so the window that it needs."""
    with errors():
        require_training()
    from slide_fmu.core.figures import plain
    from slide_fmu.core.files import write_whole
    from slide_fmu.memory.sizing import require_window
    from slide_fmu.pipeline.job import checked, open_job
    from slide_fmu.pipeline.stages import remark_on_step, size_recipe

    with progress_bars() as bar:
        job = open_job(recipe, runs, bar, tell=console.print)
        show_resolved(job.resolved)
        sizing = size_recipe(checked(job), seed)
        coarse_or_wasted = remark_on_step(job.case)
    figures = sizing.figures()
    show_sizing(figures)
    show_remark(sizing.remark)
    show_remark(coarse_or_wasted)
    kept = {**plain(figures), "step_remark": coarse_or_wasted}
    write_json(json_path, kept)
    with errors():
        write_whole(job.folder.sizing, json_bytes(kept))
        console.print(f"figures {job.folder.sizing}")
        require_window(job.recipe, sizing)


def generate(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Seed of the trajectories. Default: as in the recipe."),
    ] = None,
    runs: RunsOption = Path("runs"),
    workers: WorkersOption = None,
    executor: ExecutorOption = None,
) -> None:
    """Simulate the training data of a recipe. Several programs may share this work."""
    with errors():
        require_training()
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.stages import generate_recipe
    from slide_fmu.report.console import print_curve

    with progress_bars(GOES_ON) as bar:
        job = open_job(recipe, runs, bar, data_seed=seed, tell=console.print)
        figures = generate_recipe(job, workers, executor)
    write_json(json_path, figures)
    print_curve(figures.learning_curve, console)
    show_remark(figures.remark)
    console.print(f"data    {job.folder.trajectories}")


def train(
    recipe: RecipeArgument,
    json_path: JsonOption = None,
    seed: TrainingSeedOption = None,
    data_seed: DataSeedOption = None,
    runs: RunsOption = Path("runs"),
    threads: ThreadsOption = 1,
) -> None:
    """Train the network of a recipe, and its error estimator and bound."""
    with errors():
        require_training()
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.stages import train_recipe
    from slide_fmu.report.console import print_sizes

    with progress_bars(GOES_ON) as bar:
        job = open_job(recipe, runs, bar, seed, data_seed, None, console.print)
        figures = train_recipe(job, threads)
    write_json(json_path, figures)
    print_sizes(figures.sizes_tried, figures.explanations, console)
    show_remark(figures.remark)
    console.print(f"surrogate  {job.folder.surrogate}")
