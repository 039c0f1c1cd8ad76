"""An FMU of measured records carries their digests, so that it is measured on the same records."""

from __future__ import annotations

from slide_fmu.core.figures import JsonObject
from slide_fmu.core.search_path import find_file
from slide_fmu.fmu.export import Provenance, read_fmu
from slide_fmu.pipeline.run_folder import StageError, recipe_of_provenance
from slide_fmu.recipe.learning import LeastSquaresRecipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.rules import shares_of

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
