"""The FMU of a trained recipe, once its surrogate is known to be stable."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.fmu.export import read_fmu
from slide_fmu.memory.stability import AmplitudeTest, check_stability, require_stability
from slide_fmu.pipeline.form import Form, export_again, write_form
from slide_fmu.pipeline.job import Job, provenance
from slide_fmu.recipe.systems import recipe_system
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.figures import stability_tests

STABILITY_PICTURE = "stability.png"


def examine_stability(job: Job, surrogate: Surrogate) -> tuple[AmplitudeTest, ...]:
    """Test a state-space surrogate beyond its amplitude; the picture of a failure is kept.

    Raises:
        UnstableSurrogateError: it failed, and the recipe does not allow that.
    """
    tests = check_stability(surrogate, job.recipe, recipe_system(job.recipe))
    picture = job.folder.path / STABILITY_PICTURE
    picture.unlink(missing_ok=True)
    if any(test.problem is not None for test in tests):
        picture.write_bytes(stability_tests(tests, surrogate.window.step))
    require_stability(tests, job.recipe, str(picture))
    return tests


def export_recipe(job: Job, path: Path | None, form: Form) -> Path:
    """Write the FMU of a trained recipe.

    An FMU of the same surrogate that ``run`` has finished keeps its report and measured error.

    Args:
        path: the FMU to write; if None, that of the run folder.
        form: which FMU is written.

    Raises:
        StageError: nothing was trained.
        ValueError: no such precision.
    """
    trained = job.folder.load_surrogate(job.recipe)
    surrogate, origin = trained.surrogate, provenance(job, trained.versions)
    examine_stability(job, surrogate)
    finished = job.folder.fmu(job.recipe)
    path = path or finished
    if finished.exists():
        other, found = read_fmu(finished)
        same = {key: value for key, value in (found or {}).items() if key in origin} == origin
        if same and other.to_bytes() == surrogate.to_bytes():
            return export_again(finished, path, form)
    return write_form(surrogate, path, form, provenance=origin)
