"""This module proposes a first recipe from the declarations of a model and assumptions."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import cast

from slide_fmu.core.progress import Progress, quiet
from slide_fmu.core.search_path import make_importable
from slide_fmu.core.signals import Hold, cosines_of, moves
from slide_fmu.data.isolated_process import guarded
from slide_fmu.importer.description import is_multiple
from slide_fmu.memory.bandwidth import tidy_step
from slide_fmu.memory.step_remark import TOO_COARSE
from slide_fmu.network.state_space.cell import MOST_SUBSTEPS
from slide_fmu.propose.draft_signals import (
    MOTION_UNITS,
    Bands,
    Ranges,
    draft_inputs,
    draft_outputs,
    names_of,
    on_inputs,
    proposed_name,
    ranged_outputs,
    require_name,
)
from slide_fmu.propose.first_look import (
    FIRST_STEP,
    FirstLook,
    FirstLookSettings,
    MakeTables,
    look,
    taken_step,
)
from slide_fmu.propose.foresight import foreseen
from slide_fmu.propose.frequencies import (
    bands_of,
    in_rad,
    near_resonances,
    remarks_on_frequencies,
    require_resolved,
    require_sines,
)
from slide_fmu.propose.inputs_file import require_in_ranges, with_file
from slide_fmu.propose.proposed_chain import ProposedChain, are_angles, proposed_chain
from slide_fmu.propose.proposed_loops import proposed_loops, require_pairs
from slide_fmu.propose.surrogate_model import as_surrogate
from slide_fmu.recipe.default_excitation import InputKind, default_excitation, further_excitation
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.recipe.writing import Draft, DraftSignal, ModelDraft, recipe_text
from slide_fmu.recipe.your_inputs import lines_of_inputs, table_of_inputs
from slide_fmu.systems.base import Bending, System, chain_of
from slide_fmu.systems.declared import DeclaredModel, Parameter, SignalTable
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.loading import UNSIMULATED, describe_model, load_system
from slide_fmu.systems.specification import Specification

MOVING: tuple[InputKind, ...] = ("moving", "rates")
"""Kinds of inputs that may bend between samples."""
SUBSTEPS, STAIRS = 4, 10
"""Parts of a sample step for moving inputs: with SUBSTEPS, a sixteenth of a bend is left. An FMU
that is stepped through a sample by up to STAIRS steps anyway (``fmu-substeps``) gets the same
number."""
FINER_STEPS = 3
"""A proposed step is made finer at most this number of times."""
UNSEEN = (-1.0, 1.0)
"""Range of outputs until their range is found; no result depends on it."""


@dataclass(frozen=True)
class InitOptions:
    """InitOptions are the options of a user for a first recipe.

    Attributes:
        model: path of an FMU or a Python file, or ``"package.module:Class"``.
        inputs: ranges of inputs by name, None for the model's range. For an FMU, the
            surrogate has these inputs in this order, or all if empty.
        outputs: names of the outputs that the surrogate has, in its order; all if empty.
        kind: kind of the system; found if None.
        step: sample step in s; found if None.
        name: name of the recipe; the name of the model if None.
        folder: folder of the new recipe; the path of its model is relative to it.
        chain: URDF of the robot whose joints' set points the inputs are; if None, the only URDF in
            the model's folder, where it fits.
        hold: hold of the inputs; if None, it follows from the model.
        fmu_step: step in s of the importer that runs the replaced FMU, over which its inputs are
            held; None if they move smoothly.
        further: further models, of a kind that may have several.
        time: column of times, for files that have one.
        read: keys that say how files are read.
        loops: pairs ``OUTPUT:INPUT``, of an output that decides an input through a partner.
        jumps: whether inputs that move jump, too; if None, they do where nothing speaks against it
            (``_jump``).
        inputs_file: file of the user's own inputs, from here; None without one.
        bands: lowest and highest frequencies in Hz at which the machine works, by input.
    """

    model: str
    inputs: Ranges = field(default_factory=dict)
    outputs: tuple[str, ...] = ()
    kind: str | None = None
    step: float | None = None
    name: str | None = None
    folder: Path = Path()
    chain: Path | None = None
    hold: Hold | None = None
    fmu_step: float | None = None
    further: tuple[str, ...] = ()
    time: str | None = None
    read: Mapping[str, Parameter] = field(default_factory=dict)
    loops: tuple[str, ...] = ()
    jumps: bool | None = None
    inputs_file: Path | None = None
    bands: Bands = field(default_factory=dict)


@dataclass(frozen=True)
class Proposal:
    """A Proposal is a first recipe with its findings and assumptions.

    Attributes:
        text: the recipe as TOML.
        draft: its contents.
        remarks: one sentence for each assumption.
    """

    text: str
    draft: Draft
    remarks: tuple[str, ...]


class RefusedProposalError(RecipeError):
    """Data cannot be used as they are; a recipe says in comments what would have to change.

    Attributes:
        text: the recipe as TOML.
    """

    def __init__(self, message: str, text: str) -> None:
        super().__init__(message)
        self.text = text


@dataclass(frozen=True, eq=False)
class ModelDeclarations:
    """ModelDeclarations are the known parts of a recipe before the model is simulated.

    Attributes:
        declared: declarations of the model.
        inputs, outputs: signals of the surrogate.
        chain: the serial chain whose set points the inputs are, if there is one.
        specification: specification of the system; its step is None if it is to be proposed.
        system: the system, with some step.
        tables: makes the tables of the excitation.
        kind: kind of the inputs.
        jumps: whether inputs that move jump, too.
    """

    declared: DeclaredModel
    inputs: list[DraftSignal]
    outputs: list[DraftSignal]
    chain: ProposedChain
    specification: Specification
    system: System
    tables: MakeTables
    kind: InputKind
    jumps: bool

    @property
    def own(self) -> bool:
        """Tell whether the model declares its signals with their ranges itself."""
        return self.declared.kind == "class"


def propose_unsimulated(options: InitOptions) -> Proposal | None:
    """Propose a recipe for data that are not simulated; None where they name a model.

    Raises:
        LoadError, RecipeError: the data cannot be used.
        ValueError: the options hold some for models only.
    """
    for room in UNSIMULATED.values():
        module = import_module(f"{room}.proposal")
        proposal = cast(Proposal | None, module.propose_from_options(options))
        if proposal is not None:
            return proposal
    return None


def propose(options: InitOptions, progress: Progress) -> Proposal:
    """Propose a recipe for a model, which is simulated for some seconds.

    Raises:
        LoadError: the model cannot be made.
        RecordError: a file of inputs cannot be read, or leaves the ranges of the inputs.
        RecipeError: the range of an input is not known, a name is not one of the model, signals of
            a class are chosen, the inputs are not the set points of the given chain, or the name
            of the recipe is invalid.
        UrdfError: that chain cannot be read.
        FmuError: an FMU of slide-fmu is damaged.
        NotForgettingError: its outputs integrate, so that no window can hold it.
        SimulationError: the model could not be simulated, or crashed.
    """
    require_name(options.name)
    _require_fmu_step(options)
    require_pairs(options.loops)
    make_importable(Path(options.model).parent)
    declarations = _begin(options)
    require_pairs(options.loops, declarations.system)
    of_file = []
    if options.inputs_file is not None:
        of_file = [require_in_ranges(options.inputs_file, declarations.system.inputs)]
    seen = _look(declarations, options, progress)
    outputs, of_outputs = ranged_outputs(
        declarations.outputs, seen, bool(options.outputs), declarations.declared.limits
    )
    draft, of_recipe = _agreed(options, declarations, seen, outputs)
    draft = _with_loops(options.loops, declarations, draft)
    require_resolved(options.bands, draft.step)
    on_chain = [] if declarations.chain.remark is None else [declarations.chain.remark]
    own = (*declarations.declared.remarks, *on_inputs(declarations.declared, options.inputs))
    before = (*own, *_on_hold(declarations, draft), *on_chain)
    of_loops = (text for loop in draft.loops for text in loop.warnings)
    on_frequencies = remarks_on_frequencies(options.bands, seen, declarations.kind)
    remarks = (
        *(*before, *_on_units(draft), *of_file, *on_frequencies),
        *(*seen.remarks, *of_outputs, *of_loops, *of_recipe),
    )
    return Proposal(recipe_text(draft), draft, remarks)


def _agreed(
    options: InitOptions,
    declarations: ModelDeclarations,
    seen: FirstLook,
    outputs: list[DraftSignal],
) -> tuple[ModelDraft, list[str]]:
    """Return the contents of a recipe with whose step `try` agrees, and what else it will say.

    A step that nobody gave is made finer until its samples show what is between them.
    """
    draft = _draft(options, declarations, seen, outputs)
    of_step, refused = _foreseen(draft, declarations)
    is_open = declarations.specification.step is None and declarations.declared.held_step is None
    finer = seen
    for _ in range(FINER_STEPS):
        if not (is_open and of_step is not None and TOO_COARSE in of_step):
            break
        step = tidy_step(0.99 * finer.step)
        why = f"At {finer.step:g} s, samples do not show what is between them. {seen.origin}"
        finer = replace(finer, step=step, origin=why)
        draft = _draft(options, declarations, finer, outputs)
        of_step, refused = _foreseen(draft, declarations)
    remarks = [] if of_step is None else [f"slide-fmu try will say: {of_step}"]
    remarks += [] if refused is None else [f"slide-fmu try will refuse the recipe: {refused}"]
    return draft, remarks


def _foreseen(draft: ModelDraft, declarations: ModelDeclarations) -> tuple[str | None, str | None]:
    """Return what `try` will say of the step, and why it will refuse the recipe, or None."""
    chain = declarations.chain.path
    here = replace(
        draft,
        declared=declarations.declared,
        chain=None if chain is None else str(chain),
        inputs_file=(),
        loops=(),
    )
    return foreseen(recipe_text(here))


def _require_fmu_step(options: InitOptions) -> None:
    """Refuse a step of an importer that fits neither the model nor the sample step."""
    own = options.fmu_step
    if own is None:
        return
    if not (own > 0 and options.model.endswith(".fmu")):
        raise RecipeError(
            f"--fmu-step {own:g} for {options.model!r}; expected a positive number of seconds for "
            "an FMU: leave it out for other models"
        )
    count = None if options.step is None else max(1, round(options.step / own))
    if count is not None and not math.isclose(count * own, options.step or 0.0, rel_tol=1e-6):
        raise RecipeError(
            f"--step {options.step:g} with --fmu-step {own:g}; expected a whole number of these "
            f"steps, for example --step {count * own:.6g}"
        )


def _as_it_runs(declared: DeclaredModel, options: InitOptions) -> DeclaredModel:
    """Return a model's declarations, with the hold of inputs as its importer runs it.

    Inputs are held if the surrogate has the same step, and move over longer steps. Inputs that the
    model declares as held stay held.
    """
    if options.fmu_step is not None:
        declared = replace(declared, step=None, held_step=options.fmu_step)
    own, step = declared.held_step, options.step or declared.step
    if own is None or any(one.hold == "zero_order" for one in declared.inputs.values()):
        return declared
    hold: Hold = "first_order"
    if step is not None and math.isclose(step, own, rel_tol=1e-6):
        hold = "zero_order"
    held = SignalTable(hold=hold)
    return replace(
        declared, inputs={name: held.over(one) for name, one in declared.inputs.items()}
    )


def _on_hold(declarations: ModelDeclarations, draft: ModelDraft) -> list[str]:
    """Return remarks on the hold of an FMU's inputs in the recipe."""
    parameters = {} if draft.fmu_step is None else {"fmu-step": draft.fmu_step}
    made = replace(declarations.specification, step=draft.step, parameters=parameters)
    remark = load_system(made).input_remark if declarations.declared.kind == "fmu" else None
    return [] if remark is None else [remark]


def _on_units(draft: ModelDraft) -> list[str]:
    """Return a remark on signals of which an FMU names no unit."""
    if draft.declared.kind != "fmu":
        return []
    names = [one.name for one in (*draft.inputs, *draft.outputs) if one.table.unit is None]
    if not names:
        return []
    return [
        f"the FMU names no unit of {', '.join(names)}: write them into the recipe, as unit = "
        '"degC", and they stand in FMU, report and charts'
    ]


def _begin(options: InitOptions) -> ModelDeclarations:
    """Find the declarations of a model, and make a system of it."""
    declared = as_surrogate(describe_model(options.model, options.kind), bool(options.outputs))
    declared = _as_it_runs(declared, options)
    inputs, outputs = (
        draft_inputs(declared, options.inputs, options.hold, options.inputs_file),
        draft_outputs(declared, options.outputs),
    )
    chain = proposed_chain(declared.model, options.chain, inputs)
    specification = _specification(declared, inputs, outputs, options)
    first = taken_step(FIRST_STEP, _only_step(declared, options))
    system = load_system(replace(specification, step=specification.step or first))
    kind: InputKind = "set_points"
    if chain.path is None:
        kind = kind_of_inputs(system, in_loops=bool(options.loops))
    widths = [signal.high - signal.low for signal in system.inputs]
    turning = bool(cosines_of(system.inputs))
    if options.jumps:
        _require_jumping(kind, turning)
    jumps = _jump(options.jumps, declared, system, kind, turning)
    bands = bands_of(options.bands, system.inputs)
    require_sines(options.bands, kind)
    tables = partial(
        default_excitation,
        inputs=kind,
        widths=widths,
        turning=turning,
        jumps=jumps,
        bands=[band and in_rad(*band) for band in bands],
    )
    return ModelDeclarations(
        declared, inputs, outputs, chain, specification, system, tables, kind, jumps
    )


def _only_step(declared: DeclaredModel, options: InitOptions) -> float | None:
    """Return the step in s whose multiples alone a model takes; None if it takes any."""
    return None if declared.takes_any_step else options.fmu_step or declared.step


def _jump(
    wanted: bool | None, declared: DeclaredModel, system: System, kind: InputKind, turning: bool
) -> bool:
    """Tell whether the motions of a model shall have inputs that jump.

    Where nobody says so, forces, flows, voltages and the like do, and motions of bodies do not.
    Neither do inputs of a class, which may have an excitation of its own, nor those of a model
    that does not stop between samples.
    """
    if wanted is not None:
        return wanted
    if kind != "moving" or turning or declared.kind == "class":
        return False
    if any(signal.unit in MOTION_UNITS for signal in system.inputs):
        return False
    return isinstance(system, Bending) or declared.takes_any_step


def _require_jumping(kind: InputKind, turning: bool) -> None:
    """Refuse jumps of inputs that do not jump at any time."""
    reasons: dict[InputKind, str] = {
        "held": "the inputs are held over each step, and jump at its begin without this option",
        "rates": "the model follows the rates of its inputs, which a jump has not",
        "set_points": "the inputs count as set points of drives, which do not jump: they are "
        "angles in rad or deg, or belong to a chain of joints (inputs of other units may jump)",
        "angle": "the inputs are cosine and sine of an angle, which does not jump",
    }
    reason = reasons.get(kind, reasons["angle"] if turning else None)
    if reason is not None:
        raise RecipeError(f"--jumps, but {reason}; expected inputs that move: leave it out")


def _look(declarations: ModelDeclarations, options: InitOptions, progress: Progress) -> FirstLook:
    """Simulate the model for its step, and for ranges unless it declares them."""
    declared, system = declarations.declared, declarations.system
    excitation, file = None if declarations.own else declarations.tables, options.inputs_file
    if excitation is not None and file is not None:
        excitation = partial(with_file, excitation, str(file))
    driven = declarations.kind in ("set_points", "angle")
    settings = FirstLookSettings(
        declarations.specification,
        _origin(options),
        excitation,
        driven,
        _only_step(declared, options),
        [band and band[1] for band in bands_of(options.bands, system.inputs)],
    )
    # a progress bar cannot be sent to another program
    shown = quiet if system.may_crash else progress
    return guarded(system, (declared.model, declared.kind), look, settings, shown)


def _draft(
    options: InitOptions,
    declarations: ModelDeclarations,
    seen: FirstLook,
    outputs: list[DraftSignal],
) -> ModelDraft:
    """Return the contents of the recipe."""
    declared, chain = declarations.declared, declarations.chain.path
    step, origin, fmu_step = _run_by_steps(declarations, options, seen)
    name = proposed_name(declared.model, options.name)
    tables = declarations.tables(step, resonances=near_resonances(seen, step))
    inputs_file: list[str] = []
    if options.inputs_file is not None:
        path = _from_folder(str(options.inputs_file), options.folder)
        inputs_file = lines_of_inputs(table_of_inputs(path, tables))
    return ModelDraft(
        name,
        f"{name}: inputs {names_of(declarations.inputs)}, outputs {names_of(outputs)}",
        tuple(declarations.inputs),
        tuple(outputs),
        step,
        origin,
        replace(declared, model=_from_folder(declared.model, options.folder)),
        tables,
        declares_signals=declarations.own,
        further=further_excitation(
            step, declarations.kind, bool(cosines_of(declarations.system.inputs))
        ),
        kind_of_inputs=declarations.kind,
        chain=None if chain is None else _from_folder(str(chain), options.folder),
        substeps=_substeps(declarations, step, fmu_step),
        fmu_step=fmu_step,
        jumps=declarations.jumps if declarations.kind == "moving" else None,
        inputs_file=inputs_file,
    )


def _with_loops(
    pairs: tuple[str, ...], declarations: ModelDeclarations, draft: ModelDraft
) -> ModelDraft:
    """Return the contents with loops around the system, which is simulated for them."""
    if not pairs:
        return draft
    parameters = {} if draft.fmu_step is None else {"fmu-step": draft.fmu_step}
    made, model = replace(declarations.specification, parameters=parameters), declarations.declared
    named = model.model, model.kind
    loops = guarded(declarations.system, named, proposed_loops, pairs, made, draft.step)
    return replace(draft, loops=tuple(loops))


def _run_by_steps(
    declarations: ModelDeclarations, options: InitOptions, seen: FirstLook
) -> tuple[float, str, float | None]:
    """Return sample step in s, its origin, and the importer's step for the recipe.

    A proposed step becomes an integer multiple of the importer's step, divisible if it is large.
    """
    own, step = declarations.declared.held_step, seen.step
    if own is None:
        return step, seen.origin, None
    if options.step is None and declarations.declared.step is None:
        count = max(1, round(step / own))
        if count > MOST_SUBSTEPS and _parts(count) < SUBSTEPS:
            count = SUBSTEPS * round(count / SUBSTEPS)
        origin = f"{seen.origin} It is {count} steps of {own:g} s, by which the FMU is run."
        return float(f"{count * own:.10g}"), origin, own
    whole = is_multiple(step, own)
    named = options.fmu_step is not None or (whole and declarations.kind in MOVING)
    return step, seen.origin, own if named else None


def _substeps(declarations: ModelDeclarations, step: float, fmu_step: float | None) -> int:
    """Return the number of parts of a sample step in s in which inputs bend: 1 if they do not.

    A class may bend inputs in a way of its own; it gets parts only if inputs jump.
    """
    if declarations.kind not in MOVING or (declarations.own and not declarations.jumps):
        return 1
    if fmu_step is not None:
        return _parts(round(step / fmu_step))
    parts = STAIRS if declarations.system.holds_inputs_over_own_step else SUBSTEPS
    try:
        finer = load_system(replace(declarations.specification, step=step / parts))
    except LoadError:  # the model has its own step
        return 1
    return parts if math.isclose(finer.step, step / parts) else 1


def _parts(stairs: int) -> int:
    """Return in how many equal parts a number of stairs is divided: SUBSTEPS, or soon more."""
    whole = [n for n in range(1, MOST_SUBSTEPS + 1) if stairs % n == 0]
    return next((n for n in whole if n >= SUBSTEPS), whole[-1])


def kind_of_inputs(system: System, in_loops: bool = False) -> InputKind:
    """Return the kind of the inputs of a system.

    They are set points of drives if they belong to its chain, or if all are angles. In loops, an
    angle is where a partner is, which no drive sets.
    """
    if chain_of(system) is not None or (are_angles(system.inputs) and not in_loops):
        return "set_points"
    if [signal.angle for signal in system.inputs] == ["cosine", "sine"]:
        return "angle"
    if not moves(system.inputs):
        return "held"
    return "rates" if system.follows_rates else "moving"


def _from_folder(model: str, folder: Path) -> str:
    """Return the name of a model in a recipe: a file has its path from the folder."""
    file, colon, name = model.partition(":")
    if not Path(file).is_file():
        return model
    return Path(os.path.relpath(file, folder)).as_posix() + colon + name


def _specification(
    declared: DeclaredModel,
    inputs: list[DraftSignal],
    outputs: list[DraftSignal],
    options: InitOptions,
) -> Specification:
    """Return the specification of the system; its step is None if it is to be proposed."""
    own, unseen = declared.kind == "class", SignalTable(range=UNSEEN)
    only = None if declared.takes_any_step else options.fmu_step
    return Specification(
        declared.model,
        {} if only is None else {"fmu-step": only},
        declared.step if options.step is None else options.step,
        declared.kind,
        {} if own else {signal.name: signal.table for signal in inputs},
        {} if own else {signal.name: unseen.over(signal.table) for signal in outputs},
    )


def _origin(options: InitOptions) -> str:
    """Return the origin of a step that is not proposed."""
    if options.step is not None:
        return "The sample step in s that was given."
    return "The sample step in s that the model suggests."
