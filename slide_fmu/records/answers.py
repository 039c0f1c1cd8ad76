"""These functions answer for records where a system would be simulated.

Each names the question that it answers (``slide_fmu.data.answers``). The last ones are answered by
functions of other modules.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from concurrent.futures import Executor
from pathlib import Path

import numpy as np

from slide_fmu.core.figures import JsonObject
from slide_fmu.core.measures import percent
from slide_fmu.core.progress import Progress, Stages
from slide_fmu.core.search_path import find_file
from slide_fmu.core.signals import FloatArray
from slide_fmu.data import generation, model_answers, unseen, workplace
from slide_fmu.data.parameter_draws import as_row
from slide_fmu.data.trajectories import Trajectories
from slide_fmu.data.unseen import UnseenMotion
from slide_fmu.fmu.export import Provenance, read_fmu
from slide_fmu.memory import stability
from slide_fmu.memory.stability import SEQUENCES
from slide_fmu.pipeline import case_checks, job, numbers, stages, time_left
from slide_fmu.pipeline.run_folder import RunFolder, StageError, recipe_of_provenance
from slide_fmu.propose import trial
from slide_fmu.recipe.against_system import require_features
from slide_fmu.recipe.automatic import (
    BOUND_NUMBERS,
    LEAST_CALIBRATION,
    NUMBERS,
    FoundValues,
    nested,
)
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.learning import LeastSquaresRecipe
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.own_memory import require_own_memory
from slide_fmu.records.remarks import remarks_on_division, remarks_on_records
from slide_fmu.records.rules import shares_of
from slide_fmu.records.segments import Segment, inputs_beyond, segments, unseen_blocks
from slide_fmu.records.sizing import lengths_of_case, size_case
from slide_fmu.records.specimens import specimens
from slide_fmu.records.validation import validate_records
from slide_fmu.report import run_report
from slide_fmu.report.html_report import ReportSection
from slide_fmu.surrogate.error_bound import USUAL_CONFIDENCE
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation import measure, validate
from slide_fmu.validation.error_figures import ResponseFigures
from slide_fmu.validation.measure import Meter
from slide_fmu.validation.results import Validation
from slide_fmu.validation.row import Row

KEY = "records"
"""Key of the provenance with the names and SHA-256 hashes of the files."""
OF_NOISE = "noise_record"
"""Key of the provenance with name and SHA-256 hash of the noise record, if there is one."""


def record_origin(source: MeasuredRecords) -> JsonObject:
    """Return the part of a provenance that names records."""
    files = zip(source.files, source.digests, strict=True)
    origin_of_records: JsonObject = {
        KEY: [{"file": name, "sha256": digest} for name, digest in files]
    }
    if source.noise_record is not None:
        origin_of_records[OF_NOISE] = {
            "file": source.noise_record.file,
            "sha256": source.noise_record.digest,
        }
    return origin_of_records


def require_same_records(source: MeasuredRecords, provenance: Provenance, fmu: str) -> None:
    """Refuse records that have changed since an FMU was learnt from them.

    They would be divided at other samples, so samples that are called unseen might have been
    learnt from. Another noise record would give another noise to compare the error with.

    Raises:
        StageError: a file has changed, or the FMU does not name its records.
    """
    origin = record_origin(source)
    wanted, current = provenance.get(KEY, []), origin.get(KEY, [])
    for one, other in zip(current, wanted, strict=False):
        if one["sha256"] != other["sha256"]:
            raise StageError(
                f"record {one['file']!r} has the SHA-256 hash {one['sha256'][:12]}...; expected "
                f"{other['sha256'][:12]}..., that of {other['file']!r} from which {fmu} was "
                "learnt: restore the file, or train again, since samples that were learnt from "
                "might be measured as unseen ones"
            )
    if len(current) != len(wanted):
        raise StageError(
            f"{fmu} was learnt from {len(wanted)} known records; expected the {len(current)} of "
            "its recipe: train again"
        )
    own, other = origin.get(OF_NOISE), provenance.get(OF_NOISE)
    if own is not None and other is not None and own["sha256"] != other["sha256"]:
        raise StageError(
            f"noise record {own['file']!r} has the SHA-256 hash {own['sha256'][:12]}...; expected "
            f"{other['sha256'][:12]}..., that of {other['file']!r} with which {fmu} was learnt: "
            "restore the file, or train again"
        )


def require_unlearnt(source: MeasuredRecords, recipe: Recipe) -> None:
    """Refuse a start that has learnt from these records where they were divided otherwise.

    What it has learnt from would be measured as unseen.

    Raises:
        RecipeError: the FMU ``training.start`` is such a start.
    """
    training = recipe.training
    if not isinstance(training, LeastSquaresRecipe) or training.start is None:
        return
    _, provenance = read_fmu(find_file(training.start))
    learnt = [one["sha256"] for one in (provenance or {}).get(KEY, [])]
    pairs = zip(source.files, source.digests, strict=True)
    shared = [name for name, digest in pairs if digest in learnt]
    if not shared:
        return
    former = recipe_of_provenance(provenance, training.start)
    same = former.data.by == recipe.data.by and shares_of(former) == shares_of(recipe)
    if same and learnt == list(source.digests):
        return
    raise RecipeError(
        f"recipe {recipe.name!r}: training.start = {training.start!r} has learnt from {shared}, "
        "divided otherwise, so that samples which it knows would be measured as unseen ones; "
        "expected other records, or the same records with its data.shares and data.by"
    )


@model_answers.identity.register(MeasuredRecords)
def identity_of_records(source: MeasuredRecords, recipe: Recipe) -> FloatArray:
    """Return the SHA-256 of each file as numbers."""
    return source.identity


@generation.make_missing.register(MeasuredRecords)
def cut_missing(
    source: MeasuredRecords,
    trajectories: Trajectories,
    executor: Executor | None,
    progress: Progress,
    recipe_folder: Path | None,
) -> int:
    """Cut the segments of all parts that are not there yet; return their number."""
    recipe, missing = trajectories.case.recipe, trajectories.missing()
    total, cut = recipe.total_count, dict[str, list[Segment]]()
    progress(total - len(missing), total)
    for made, (split, index) in enumerate(missing, start=1):
        if split not in cut:
            cut[split] = segments(recipe, source, split)
        segment = cut[split][index]
        values = as_row(segment.parameters) if segment.parameters else None
        trajectories.write(split, index, segment.trajectory, segment.file, values)
        progress(total - len(missing) + made, total)
    return len(missing)


@workplace.require_work_elsewhere.register(MeasuredRecords)
def refuse_work_elsewhere(source: MeasuredRecords, recipe: Recipe, executor: str) -> None:
    """Refuse a cluster: records are cut here.

    Raises:
        RecipeError: always.
    """
    raise RecipeError(
        f"recipe {recipe.name!r} is of records, which are cut and not simulated; expected no "
        f"--executor {executor}: leave it out"
    )


@unseen.known_or_simulated.register(MeasuredRecords)
def unseen_records(
    source: MeasuredRecords, recipe: Recipe, simulate: Callable[[], list[UnseenMotion]]
) -> list[UnseenMotion]:
    """Return the blocks of records that are not learnt from.

    Raises:
        RecipeError: the records are too short.
    """
    return [
        UnseenMotion(
            block.trajectory.inputs,
            block.trajectory.outputs,
            block.lead,
            block.file,
            block.parameters,
        )
        for block in unseen_blocks(recipe, source)
    ]


@stability.excited_inputs.register(MeasuredRecords)
def recorded_inputs(
    source: MeasuredRecords, recipe: Recipe, count: int, factor: float
) -> FloatArray:
    """Cut inputs out of the records, and multiply their deviations from the mean."""
    return inputs_beyond(recipe, source, count, SEQUENCES, factor)


@stability.simulated_growth.register(MeasuredRecords)
def unknown_growth(
    source: MeasuredRecords, case: Case, values: dict[str, float], count: int, factor: float
) -> FloatArray:
    """Return zeros, (n_outputs,): beyond records nothing is known, so they allow no growth."""
    return np.zeros(len(source.outputs))


@stability.tested_corners.register(MeasuredRecords)
def tested_specimens(
    source: MeasuredRecords, surrogate: Surrogate, recipe: Recipe
) -> list[dict[str, float]]:
    """Return the parameters of the specimens, in place of the corners of their box."""
    return specimens(recipe)


@case_checks.check_systems.register(MeasuredRecords)
def check_records(source: MeasuredRecords, case: Case) -> None:
    """Refuse features that the records do not have, and a start that knows what is unseen here."""
    require_features(case.recipe, source)
    require_unlearnt(source, case.recipe)


@numbers.found_numbers.register(MeasuredRecords)
def numbers_of_segments(
    source: MeasuredRecords, case: Case, open_keys: Collection[str], folder: RunFolder
) -> FoundValues:
    """Return the numbers of segments that a recipe leaves open; they follow from the samples.

    Raises:
        RecipeError: a part has no segment.
    """
    return _numbers(case.recipe, open_keys, source)


@time_left.cost_of_second.register(MeasuredRecords)
def no_simulation(source: MeasuredRecords, case: Case, folder: RunFolder, bar: Stages) -> float:
    """Return 0 s: nothing is simulated."""
    return 0.0


@numbers.least_numbers.register(MeasuredRecords)
def least_numbers_of_segments(
    source: MeasuredRecords, open_recipe: OpenRecipe, cost: float
) -> FoundValues:
    """Return the same numbers, since no learning curve is tried.

    Raises:
        RecipeError: a part has no segment.
    """
    return _numbers(open_recipe.guess, open_recipe.open_keys, source)


def _numbers(recipe: Recipe, open_keys: Collection[str], source: MeasuredRecords) -> FoundValues:
    wanted = [key for key in (*NUMBERS, *BOUND_NUMBERS) if key in open_keys]
    counts = {key: len(segments(recipe, source, key.partition(".")[2])) for key in wanted}
    empty = [key for key, count in counts.items() if not count]
    if empty:
        raise RecipeError(
            f"recipe {recipe.name!r}: no block of the part {empty[0]!r} has data.duration = "
            f"{recipe.data.duration:g} s; expected at least one: shorten it, or leave it out"
        )
    blocks = counts.get("data.calibration", LEAST_CALIBRATION)
    if blocks < LEAST_CALIBRATION:
        raise RecipeError(
            f"recipe {recipe.name!r}: [bound] with {blocks} held-out blocks of "
            f"{recipe.data.duration:g} s for its calibration, which allow a bound of "
            f"{percent(blocks / (blocks + 1))} at most; expected at least {LEAST_CALIBRATION}, "
            f"for {percent(USUAL_CONFIDENCE)}: record more, give data.shares more calibration, or "
            "remove the table [bound]"
        )
    return nested(counts)


@stages.step_of_case.register(MeasuredRecords)
def no_remark_on_step(source: MeasuredRecords, case: Case) -> None:
    """Return no remark on the step: the signals between samples are unknown."""


@measure.further_rows.register(MeasuredRecords)
def no_further_rows(
    source: MeasuredRecords, meter: Meter, in_range: Validation, case: Case, bar: Stages
) -> list[Row]:
    """Return no rows of further inputs: nothing can be simulated."""
    return []


@run_report.affine_response.register(MeasuredRecords)
def no_response(
    source: MeasuredRecords, surrogate: Surrogate
) -> tuple[ResponseFigures | None, list[ReportSection]]:
    """Return no response matrix: records have no exact one to compare with."""
    return None, []


@trial.tried_motions.register(MeasuredRecords)
def tried_records(source: MeasuredRecords, case: Case) -> trial.MotionTrial:
    """Return remarks on the lost samples and the findings of the records; nothing is simulated."""
    return trial.MotionTrial((*remarks_on_division(case.recipe, source), *source.remarks))


job.lengths_of_case.register(MeasuredRecords)(lengths_of_case)
stages.size_case.register(MeasuredRecords)(size_case)
validate.validate_against.register(MeasuredRecords)(validate_records)
validate.origin_of_data.register(MeasuredRecords)(record_origin)
validate.require_same_origin.register(MeasuredRecords)(require_same_records)
validate.require_own_memory.register(MeasuredRecords)(require_own_memory)
run_report.remarks_on_data.register(MeasuredRecords)(remarks_on_records)
