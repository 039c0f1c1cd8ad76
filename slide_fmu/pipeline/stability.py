"""A trained surrogate must be stable enough to become an FMU."""

from __future__ import annotations

from slide_fmu.memory.stability import AmplitudeTest, check_stability, require_stability
from slide_fmu.pipeline.job import Job
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
