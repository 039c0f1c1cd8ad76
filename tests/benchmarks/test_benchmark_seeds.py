"""No benchmark measures on motions that trained, chose or validated anything."""

from __future__ import annotations

from pathlib import Path

import seeds

from slide_fmu.cli import UNSEEN_SEED
from slide_fmu.recipe import load_recipe

HERE = Path(__file__).parent
TRAINING = HERE.parents[1] / "training"


def test_every_benchmark_has_seeds_of_its_own() -> None:
    own = [value for name, value in vars(seeds).items() if name.isupper()]
    both = [number for seed in [UNSEEN_SEED, *own] for number in (seed, seed + 1)]
    learnt = [load_recipe(path).data.seed for path in TRAINING.glob("*.toml")]
    assert len(own) > 5
    assert len(set(both)) == len(both)
    assert not set(both) & set(learnt)


def test_no_benchmark_uses_the_seed_of_validations() -> None:
    names = [path.name for path in HERE.glob("*.py") if not path.name.startswith("test_")]
    users = [name for name in names if "UNSEEN_SEED" in (HERE / name).read_text("utf-8")]
    assert "paper_segments.py" in names
    assert users == []
