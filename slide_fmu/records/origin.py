"""An FMU of measured records carries their digests, so that it is measured on the same records."""

from __future__ import annotations

from slide_fmu.core.figures import JsonObject
from slide_fmu.fmu.export import Provenance
from slide_fmu.pipeline.run_folder import StageError
from slide_fmu.records.model import MeasuredRecords

KEY = "records"
"""Key of the provenance with the names and SHA-256 hashes of the files."""
OF_NOISE = "noise_record"
"""Key of the provenance with name and SHA-256 hash of the noise record, if there is one."""


def record_origin(source: MeasuredRecords) -> JsonObject:
    """Return the part of a provenance that names records."""
    files = zip(source.files, source.digests, strict=True)
    found: JsonObject = {KEY: [{"file": name, "sha256": digest} for name, digest in files]}
    if source.noise_record is not None:
        found[OF_NOISE] = {"file": source.noise_record.file, "sha256": source.noise_record.digest}
    return found


def require_same_records(source: MeasuredRecords, provenance: Provenance, fmu: str) -> None:
    """Refuse records that have changed since an FMU was learnt from them.

    They would be divided at other samples, so samples that are called unseen might have been
    learnt from. Another noise record would give another noise to compare the error with.

    Raises:
        StageError: a file has changed, or the FMU does not name its records.
    """
    origin = record_origin(source)
    wanted, found = provenance.get(KEY, []), origin.get(KEY, [])
    for one, other in zip(found, wanted, strict=False):
        if one["sha256"] != other["sha256"]:
            raise StageError(
                f"record {one['file']!r} has the SHA-256 hash {one['sha256'][:12]}...; expected "
                f"{other['sha256'][:12]}..., that of {other['file']!r} from which {fmu} was "
                "learnt: restore the file, or train again, since samples that were learnt from "
                "might be measured as unseen ones"
            )
    if len(found) != len(wanted):
        raise StageError(
            f"{fmu} was learnt from {len(wanted)} known records; expected the {len(found)} of its "
            "recipe: train again"
        )
    own, other = origin.get(OF_NOISE), provenance.get(OF_NOISE)
    if own is not None and other is not None and own["sha256"] != other["sha256"]:
        raise StageError(
            f"noise record {own['file']!r} has the SHA-256 hash {own['sha256'][:12]}...; expected "
            f"{other['sha256'][:12]}..., that of {other['file']!r} with which {fmu} was learnt: "
            "restore the file, or train again"
        )
