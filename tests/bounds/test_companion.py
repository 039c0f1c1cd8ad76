"""A companion that is trained next to its surrogate is the one that is trained after it."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from slide_fmu.bounds import companion
from slide_fmu.bounds.companion import COMPANION, Companion, is_accurate
from slide_fmu.bounds.fit import fit_surrogate
from slide_fmu.core.progress import Progress
from slide_fmu.core.result_cache import DamagedFileError
from slide_fmu.data.generation import generate
from slide_fmu.data.isolated_process import IsolatedCall
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.network import SURROGATE, Fit
from slide_fmu.fitting.preparation import Work
from slide_fmu.recipe.case import case_of
from tests.bounds.learnt_soon import LEARNT_SOON
from tests.progress import silent
from tests.recipes import tiny_state_space_recipe
from tests.refusals import refused

RECIPE = tiny_state_space_recipe(
    **{**LEARNT_SOON, "network": {"order": "auto", "hidden": 6}},
    data={"train": 4, "bound": 8, "calibration": 20},
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("companion")
    with ThreadPoolExecutor(1) as pool:
        generate(case_of(RECIPE), folder, pool, silent)
    return folder


@pytest.fixture(autouse=True)
def _two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(companion, "usable_cores", lambda: 2)


def fitted(folder: Path, checkpoints: Path, side_by_side: bool) -> tuple[Fit, dict[str, int]]:
    """Return a fit, and how often the progress of each stage was shown."""
    shown: dict[str, int] = {}

    def bar(name: str) -> Progress:
        def show(done: int, total: int, error: float | None = None) -> None:
            shown[name] = shown.get(name, 0) + 1

        return show

    return fit_surrogate(Work(case_of(RECIPE), folder, checkpoints, bar), side_by_side), shown


@dataclass(frozen=True, eq=False)
class Alone:
    """A fit whose companion was trained after its surrogate, in this program."""

    fit: Fit
    shown: dict[str, int]
    checkpoints: Path


@pytest.fixture(scope="module")
def alone(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Alone:
    checkpoints = tmp_path_factory.mktemp("alone")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(companion, "IsolatedCall", None)  # it begins no other program
        return Alone(*fitted(folder, checkpoints, False), checkpoints)


@pytest.mark.extended
def test_companion_in_a_program_of_its_own_is_the_same_to_the_bit(
    folder: Path, alone: Alone, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    began: list[tuple[object, ...]] = []

    class Noted(IsolatedCall):  # type: ignore[misc, type-arg]
        def __enter__(self) -> IsolatedCall[object]:
            began.append(())
            return super().__enter__()

    monkeypatch.setattr(companion, "IsolatedCall", Noted)
    both, shown = fitted(folder, tmp_path, True)
    assert len(began) == 1
    assert both.surrogate.to_bytes() == alone.fit.surrogate.to_bytes()
    assert both.histories == alone.fit.histories
    assert both.histories[COMPANION].cpu_seconds
    assert shown == alone.shown
    names = [sorted(file.name for file in way.iterdir()) for way in (alone.checkpoints, tmp_path)]
    assert names[0] == names[1]


@pytest.mark.extended
def test_one_core_trains_one_after_the_other(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = Work(case_of(RECIPE), folder, tmp_path, lambda name: silent)
    assert companion.has_a_core(work)
    monkeypatch.setattr(companion, "usable_cores", lambda: 1)
    assert not companion.has_a_core(work)


def test_error_of_the_other_program_is_raised_here(
    folder: Path, alone: Alone, tmp_path: Path
) -> None:
    """The checkpoint of the companion is damaged, which was the last surrogate to be trained."""
    kept = {file.stat().st_mtime_ns: file for file in alone.checkpoints.glob("surrogate-*.pt")}
    last = kept[max(kept)]
    (tmp_path / last.name).write_bytes(last.read_bytes()[:-9])
    with pytest.raises(DamagedFileError, match=last.name):
        fitted(folder, tmp_path, True)


@pytest.mark.extended
def test_program_that_was_ended_is_told_with_what_remains(
    folder: Path, alone: Alone, tmp_path: Path
) -> None:
    work, fit = Work(case_of(RECIPE), folder, tmp_path, lambda name: silent), alone.fit
    with Companion(work, True) as begun:
        begun.begin(fit.recipe, fit.surrogate.output_scaling)
        assert begun._first is not None
        begun._first._program.kill()
        with refused(TrainingError, "a program of its own", "the same command goes on from here"):
            begun.of(replace(fit, histories={SURROGATE: fit.histories[SURROGATE]}))


@pytest.mark.parametrize(
    ("error", "beside", "enough"),
    [
        (0.013, 0.01, True),
        (0.0131, 0.01, False),  # at large errors the bound follows
        (0.0019, 0.001, True),
        (0.0021, 0.001, False),
        (0.0021, 0.0018, True),
        (0.001, 0.0004, False),  # a very accurate surrogate has a companion that is so too
    ],
)
def test_companion_is_accurate_enough(error: float, beside: float, enough: bool) -> None:
    assert is_accurate(error, beside) == enough
