"""No benchmark measures on motions that trained, chose or validated anything."""

from __future__ import annotations

from pathlib import Path

import seeds

from slide_fmu.recipe.reading import load_recipe
from slide_fmu.validation.task import UNSEEN_SEED

HERE = Path(__file__).parent
TRAINING = HERE.parents[1] / "training"


def test_seeds_are_nowhere_else() -> None:
    own = [value for name, value in vars(seeds).items() if name.isupper()]
    both = [number for seed in [UNSEEN_SEED, *own] for number in (seed, seed + 1)]
    learnt = [load_recipe(path).data.seed for path in TRAINING.glob("*.toml")]
    assert len(own) > 3
    assert len(set(both)) == len(both)
    assert not set(both) & set(learnt)
